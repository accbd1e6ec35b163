/* Between the numbers of native messages and those of the step. */
#ifndef BORECHAIN_NODE_SIGNALS_H
#define BORECHAIN_NODE_SIGNALS_H

#include "chip_node.h"

int64_t q28_of_us(int64_t us);
uint16_t node_flags(const struct chip_node *node, int64_t now_q28, bool is_dated);
int64_t node_yaw_var(int64_t var);      /* as a message says it, rad^2, Q56 */
int64_t node_var_q56(int64_t var_us2);  /* s^2 of us^2 */
int64_t us2_of_level(uint32_t level);   /* us^2 of a level of a clock's variance */
/* An aiding as the step takes it, valid at a time of the own clock. */
void aiding_for_step(
    const struct borechain_native_aiding *heard,
    int64_t valid_us,
    int64_t clock_var_us2,
    int64_t aiding[12]);
/* The same as it goes down: the encoder's measurement unchanged, the path as the record has it. */
void aiding_for_below(
    const struct borechain_native_aiding *heard,
    const struct borechain_node *record,
    struct borechain_native_aiding *said);
void state_of_node(const struct chip_node *node, int64_t now_us, struct borechain_native_node_state *state);

#endif
