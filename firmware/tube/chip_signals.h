/* A chip's cyclic messages: hello, time, aidings on their way down, states on their way up. */
#ifndef BORECHAIN_CHIP_SIGNALS_H
#define BORECHAIN_CHIP_SIGNALS_H

#include "chip_node.h"

#define HELLO_EVERY_MS 1000u

void signals_say_state(struct chip_node *node);
/* To both sides. */
void signals_say_hello(struct chip_node *node);
void signals_ask_time(struct chip_node *node);
/* What came at a side, by its type. */
void signals_hear(struct chip_node *node, enum node_side side, int type, const union native_message *heard);

#endif
