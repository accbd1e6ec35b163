/* What a node begins with, keeps, and forgets at a start. */
#ifndef BORECHAIN_NODE_MEMORY_H
#define BORECHAIN_NODE_MEMORY_H

#include "chip_node.h"

/* The image's records, then the newest whole save over them; false where the image is none of this program. */
bool memory_load(struct chip_node *node, const uint8_t *image, uint32_t image_size);
void memory_save(struct chip_node *node, uint32_t now_ms);
/* A saved record is ready for its first cycle after an outage of unknown length, as Python's `resume_node`. */
void memory_resume(struct borechain_node *record, const struct borechain_config *config);

#endif
