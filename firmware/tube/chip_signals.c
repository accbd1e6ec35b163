/* A chip's cyclic messages, see chip_signals.h. */
#include "chip_signals.h"

#include "borechain_native.h"
#include "chip_said.h"
#include "msgpack.h"
#include "node_signals.h"

#define WHOLE_QUALITY 100u
#define MOST_HOPS 250
#define ONWARD 2

static uint8_t count_of(const struct chip_end *end)
{
    return (uint8_t)end->link.frames;
}

void signals_say_state(struct chip_node *node)
{
    struct borechain_native_node_state state;
    uint8_t data[BORECHAIN_NATIVE_NODE_STATE_LENGTH];
    struct chip_end *const end = &node->ends[NODE_UPPER];
    if (said_by_words(node, node->clock.told.epoch)) {
        node->said.is_state_due = true;
        return;
    }
    state_of_node(node, node->cycle_us, &state);
    if (borechain_native_pack_node_state(&state, count_of(end), data) == BORECHAIN_NATIVE_TAKEN) {
        chip_end_say(end, BORECHAIN_NATIVE_NODE_STATE_IDENTIFIER, state.tube, data, sizeof data);
    }
}

static void pass_state(struct chip_node *node, const struct borechain_native_node_state *state)
{
    uint8_t data[BORECHAIN_NATIVE_NODE_STATE_LENGTH];
    struct chip_end *const end = &node->ends[NODE_UPPER];
    if (borechain_native_pack_node_state(state, count_of(end), data) == BORECHAIN_NATIVE_TAKEN) {
        chip_end_say(end, BORECHAIN_NATIVE_NODE_STATE_IDENTIFIER, state->tube, data, sizeof data);
    }
}

void signals_say_hello(struct chip_node *node)
{
    struct borechain_native_hello hello;
    uint8_t data[BORECHAIN_NATIVE_HELLO_LENGTH];
    uint32_t side;
    if (said_by_words(node, 0u)) {
        node->said.is_hello_due[NODE_UPPER] = node->said.is_hello_due[NODE_LOWER] = true;
        return;
    }
    hello.tube = node->identity.tube;
    hello.boot_count = node->kept.boots;
    hello.hops = (int16_t)node->kept.hops;
    hello.mode = (uint8_t)node->record.filter.mode;
    hello.link_quality = WHOLE_QUALITY;
    for (side = 0u; side < 2u; side++) {
        if (borechain_native_pack_hello(&hello, count_of(&node->ends[side]), data) == BORECHAIN_NATIVE_TAKEN) {
            chip_end_say(&node->ends[side], BORECHAIN_NATIVE_HELLO_IDENTIFIER, 0u, data, sizeof data);
        }
    }
}

void signals_ask_time(struct chip_node *node)
{
    struct borechain_native_time_request request;
    uint8_t data[BORECHAIN_NATIVE_TIME_REQUEST_LENGTH];
    struct chip_end *const end = &node->ends[NODE_UPPER];
    if (said_by_words(node, node->clock.told.epoch)) {
        node->said.is_request_due = true;
        return;
    }
    request.asked_at = node->now_us / 10;
    node->said.asked_us = request.asked_at * 10; /* the answer may be by words */
    if (borechain_native_pack_time_request(&request, count_of(end), data) == BORECHAIN_NATIVE_TAKEN) {
        chip_end_say(end, BORECHAIN_NATIVE_TIME_REQUEST_IDENTIFIER, 0u, data, sizeof data);
    }
}

static void tell_time(struct chip_node *node, const struct borechain_native_time_request *request)
{
    struct borechain_native_time_reply reply;
    uint8_t data[BORECHAIN_NATIVE_TIME_REPLY_LENGTH];
    struct chip_end *const end = &node->ends[NODE_LOWER];
    struct borechain_native_node_state own;
    if (node->clock.exchanges == 0u) {
        return;
    }
    if (said_by_words(node, node->clock.told.epoch)) {
        said_asked(node, bits_of_quantity(q28_of_us(request->asked_at * 10), 28));
        return;
    }
    state_of_node(node, node->now_us, &own); /* its clock_var is in the levels of a reply */
    reply.asked_at = request->asked_at;
    reply.received_at = reply.replied_at = node->now_us / 10;
    reply.rig_at = clock_rig_from_local(&node->clock, node->now_us) / 10;
    reply.rig_rate = (uint32_t)clock_rig_rate(&node->clock);
    reply.clock_var = own.clock_var;
    reply.epoch = (uint16_t)node->clock.told.epoch;
    if (borechain_native_pack_time_reply(&reply, count_of(end), data) == BORECHAIN_NATIVE_TAKEN) {
        chip_end_say(end, BORECHAIN_NATIVE_TIME_REPLY_IDENTIFIER, 0u, data, sizeof data);
    }
}

static void hear_time(struct chip_node *node, const struct borechain_native_time_reply *heard)
{
    struct clock_reply reply;
    reply.asked_us = heard->asked_at * 10;
    reply.received_us = heard->received_at * 10;
    reply.replied_us = heard->replied_at * 10;
    reply.rig_us = heard->rig_at * 10;
    reply.rig_var = us2_of_level(heard->clock_var);
    reply.rig_rate = heard->rig_rate;
    reply.epoch = heard->epoch;
    clock_exchange(&node->clock, &reply, node->now_us);
}

void signals_meet(struct chip_node *node, enum node_side side, uint8_t tube, int64_t hops)
{
    if (!node->has_neighbour[side] || node->neighbours[side] != tube) {
        node->hello_at_ms = node_ms(node->now_us) - HELLO_EVERY_MS; /* a newcomer learns at once who is here */
        if (side == NODE_UPPER && node->has_neighbour[side]) {
            clock_doubt(&node->clock);
        }
    }
    node->has_neighbour[side] = true;
    node->neighbours[side] = tube;
    if (side == NODE_UPPER && hops >= 0 && hops < MOST_HOPS) {
        node->save_is_due = node->save_is_due || node->kept.hops != hops + 1;
        node->kept.hops = (int32_t)hops + 1;
        node->is_told_hops = true;
    }
}

bool signals_take_aiding(struct chip_node *node, int64_t aiding[12], int64_t valid_rig_us, uint32_t epoch)
{
    int64_t valid_us;
    if (epoch != node->clock.told.epoch && epoch != 0u && node->clock.told.epoch != 0u) {
        node->ask_at_ms = node_ms(node->now_us);
        return false;
    }
    valid_us = clock_local_from_rig(&node->clock, valid_rig_us);
    if (node->clock.stepped_us != CLOCK_UNKNOWN) {
        valid_us -= node->clock.stepped_us; /* the cycle learns of the step, and moves what waits for it */
    }
    aiding[5] = q28_of_us(valid_us);
    aiding[11] = node_var_q56(node_clock_var(node));
    return (borechain_aiding(&node->record, &node->settings, aiding) & ONWARD) != 0;
}

static void hear_aiding(struct chip_node *node, const struct borechain_native_aiding *heard)
{
    struct borechain_native_aiding onward;
    uint8_t data[BORECHAIN_NATIVE_AIDING_LENGTH];
    int64_t aiding[12];
    struct chip_end *const end = &node->ends[NODE_LOWER];
    if (node->clock.exchanges == 0u) {
        return;
    }
    aiding_for_step(heard, 0, 0, aiding);
    if (!signals_take_aiding(node, aiding, heard->valid_at * 10, heard->epoch)) {
        return;
    }
    aiding_for_below(heard, &node->record, &onward);
    if (borechain_native_pack_aiding(&onward, count_of(end), data) == BORECHAIN_NATIVE_TAKEN) {
        chip_end_say(end, BORECHAIN_NATIVE_AIDING_IDENTIFIER, 0u, data, sizeof data);
    }
}

void signals_hear(struct chip_node *node, enum node_side side, int type, const union native_message *heard)
{
    switch (type) {
    case BORECHAIN_NATIVE_AIDING_TYPE:
        if (side == NODE_UPPER) {
            hear_aiding(node, &heard->aiding);
        }
        break;
    case BORECHAIN_NATIVE_HELLO_TYPE:
        signals_meet(node, side, heard->hello.tube, heard->hello.hops);
        break;
    case BORECHAIN_NATIVE_TIME_REQUEST_TYPE:
        if (side == NODE_LOWER) {
            tell_time(node, &heard->time_request);
        }
        break;
    case BORECHAIN_NATIVE_TIME_REPLY_TYPE:
        if (side == NODE_UPPER) {
            hear_time(node, &heard->time_reply);
        }
        break;
    default:
        if (side == NODE_LOWER) {
            pass_state(node, &heard->node_state);
        }
        break;
    }
}
