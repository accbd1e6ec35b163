/* What a node keeps over a power cut: two slots of flash, of which one is whole at any instant.
 *
 * A save goes to the slot that does not hold the newest whole one: it is erased, the content is written, then the header
 * that makes it count, and all is read back. A slot that does not take it is reported; the other one stays as it is.
 * A header is 16 bytes, little-endian: magic, generation, length, CRC-32 of these three and the content.
 */
#ifndef BORECHAIN_TWO_SLOTS_H
#define BORECHAIN_TWO_SLOTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define SLOT_WORD 8u    /* bytes that are written at once, into erased flash alone */
#define SLOT_HEADER 16u
#define SLOT_NONE 2u

/* What a board brings: two slots, each erased as a whole. False where the flash reports a fault. */
struct slot_board {
    void *own;
    uint32_t size; /* bytes of a slot, whole words */
    bool (*erase)(void *own, uint32_t slot);
    bool (*write)(void *own, uint32_t slot, uint32_t at, const uint8_t word[SLOT_WORD]);
    void (*read)(void *own, uint32_t slot, uint32_t at, uint8_t *into, uint32_t length);
};

/* The newest whole content; `slot` is SLOT_NONE where there is none. */
struct slot_found {
    uint32_t slot;
    uint32_t generation;
    uint32_t length;
};

enum slot_answer {
    SLOT_SAVED = 0,
    SLOT_TOO_LONG = -1,
    SLOT_WORN = -2 /* the flash did not take it; what was found before is still whole */
};

void slots_find(const struct slot_board *board, struct slot_found *found);
/* The content of `found`; nothing where there is none. */
void slots_load(const struct slot_board *board, const struct slot_found *found, uint8_t *content);
/* `found` is what slots_find said, and says where the content is afterwards. */
enum slot_answer slots_save(
    const struct slot_board *board,
    struct slot_found *found,
    const uint8_t *content,
    uint32_t length);

#endif
