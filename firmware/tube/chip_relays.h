/* Payloads of others that wait for their next hop. */
#ifndef BORECHAIN_CHIP_RELAYS_H
#define BORECHAIN_CHIP_RELAYS_H

#include "chip_node.h"

/* A payload that must arrive; false where there is no room. */
bool relay_pass(struct chip_node *node, enum node_side to, const uint8_t *payload, uint32_t length);
/* A state on its way up, which may be lost: it takes half of the places at most. */
void relay_pass_state(struct chip_node *node, const uint8_t *payload, uint32_t length);
/* The state that is to go next; its length, 0 where none waits. */
uint32_t relay_take_state(struct chip_node *node, uint8_t *room, uint32_t size);
/* States do not wait for a joint that is open. */
void relay_drop_states(struct chip_node *node);
bool relay_has_room(const struct chip_node *node, enum node_side to);

#endif
