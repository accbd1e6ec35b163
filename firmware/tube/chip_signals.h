/* A chip's cyclic messages: hello, time, aidings on their way down, states on their way up. */
#ifndef BORECHAIN_CHIP_SIGNALS_H
#define BORECHAIN_CHIP_SIGNALS_H

#include "chip_node.h"

#define HELLO_EVERY_MS 1000u

void signals_say_state(struct chip_node *node);
/* To both sides. */
void signals_say_hello(struct chip_node *node);
void signals_ask_time(struct chip_node *node);
/* A neighbour has said who it is. */
void signals_meet(struct chip_node *node, enum node_side side, uint8_t tube, int64_t hops);
/* An aiding, of rig time (us) and an epoch, for the step, in whose numbers the times are missing; whether it goes on. */
bool signals_take_aiding(struct chip_node *node, int64_t aiding[12], int64_t valid_rig_us, uint32_t epoch);
/* What came at a side, by its type. */
void signals_hear(struct chip_node *node, enum node_side side, int type, const union native_message *heard);

#endif
