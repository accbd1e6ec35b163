/* A tube's node on a chip, see chip_node.h. */
#include "chip_node.h"

#include <string.h>

#include "borechain_orders.h"
#include "chip_relays.h"
#include "chip_signals.h"
#include "chip_words.h"
#include "msgpack.h"
#include "node_memory.h"
#include "node_signals.h"

#define SAY_EVENTS 1
#define SAY_SURVEY 2
#define SAY_STATE 8
#define SAY_REVISION 64
#define NO_NUMBER (INT64_C(1) << 60)
#define UNKNOWN_VAR_US2 INT64_C(12960000000000) /* (3.6 s)^2 */
#define DATED_VAR_US2 INT64_C(2500000000)       /* (0.05 s)^2 */
#define QUICK_MS 1000u
#define SLOW_MS 10000u
#define BURST 30u
#define SAVE_EVERY_MS 300000u
#define RETRY_EVERY_MS 30000u
#define PERIOD_US 526316
#define ENCODER 0u
#define BASE 251
#define STATIC_BIAS 1
#define STATE 5 /* kinds of payloads: those below are for one hop */
#define BLOCK_SEGMENT 11
#define SESSION_OFFER 15

uint32_t node_ms(int64_t us)
{
    return (uint32_t)((uint64_t)us / 1000u);
}

int64_t node_clock_var(const struct chip_node *node)
{
    const int64_t var = clock_variance(&node->clock, node->now_us);
    return var < UNKNOWN_VAR_US2 ? var : UNKNOWN_VAR_US2;
}

static bool is_dated(const struct chip_node *node)
{
    return node->clock.exchanges > 0u && node_clock_var(node) < DATED_VAR_US2;
}

static void on_upper_signals(void *own, int type, const union native_message *heard)
{
    signals_hear(own, NODE_UPPER, type, heard);
}

static void on_lower_signals(void *own, int type, const union native_message *heard)
{
    signals_hear(own, NODE_LOWER, type, heard);
}

/* Payloads */

static bool has_room_below(void *own)
{
    return relay_has_room(own, NODE_LOWER);
}

static bool has_room_above(void *own)
{
    return relay_has_room(own, NODE_UPPER);
}

static uint32_t words_up(void *own, uint8_t *room, uint32_t size)
{
    return said_next(own, NODE_UPPER, room, size);
}

static uint32_t words_down(void *own, uint8_t *room, uint32_t size)
{
    return said_next(own, NODE_LOWER, room, size);
}

static struct node_answer *answer_of(struct chip_node *node, int64_t order)
{
    uint32_t k;
    for (k = 0u; k < NODE_ANSWERS; k++) {
        if (node->kept.answers[k].length > 0u && node->kept.answers[k].order == order) {
            return &node->kept.answers[k];
        }
    }
    return NULL;
}

static const char *obey(struct chip_node *node, const struct word_order *order, bool *is_done)
{
    static const char *const refusals[] = {"", "expected a number in its range", "the node turns, or has just stopped",
        "the static bias is not known yet", "a sensor is faulty", "too fast", "an alignment is under way"};
    int64_t answer;
    if (text_is(order->name, order->name_length, "take_survey")) {
        (void)borechain_order_survey(&node->record);
        *is_done = true;
        return "at the next settled cycle";
    }
    if (text_is(order->name, order->name_length, "align") && order->method != NULL) {
        const bool is_circle = text_is(order->method, order->method_length, "circle");
        const bool is_extremes = text_is(order->method, order->method_length, "extremes");
        answer = borechain_order_alignment(&node->record, is_circle ? 1 : is_extremes ? 2 : 0, order->turns);
        *is_done = answer == BORECHAIN_TAKEN;
        return *is_done ? "turn the string slowly" : refusals[answer];
    }
    *is_done = false;
    return "expected take_survey or align: a chip obeys no other order";
}

static void on_command(struct chip_node *node, const struct word_order *order)
{
    struct node_answer *answer = answer_of(node, order->number);
    bool is_done;
    if (answer == NULL && !seals_obey(node, order->number)) {
        return;
    }
    if (answer == NULL) {
        const char *const detail = obey(node, order, &is_done);
        answer = &node->kept.answers[node->kept.next_answer];
        if (link_holds(&node->ends[NODE_UPPER].link, answer->room)) {
            return; /* it comes again */
        }
        node->kept.next_answer = (node->kept.next_answer + 1u) % NODE_ANSWERS;
        seals_answered(node, answer->length > 0u ? answer->order : 0);
        answer->order = order->number;
        answer->length = (uint8_t)word_reply(
            node->identity.tube, order->number, is_done, detail, answer->room, NODE_REPLY_ROOM);
        memory_save(node, node_ms(node->now_us));
    }
    (void)link_send(&node->ends[NODE_UPPER].link, answer->room, answer->length);
}

/* Receipts, orders, parts of a block, offers of a session. */
static bool goes_down(int64_t kind)
{
    return kind == WORDS_RECEIPT || kind == WORDS_COMMAND || kind == BLOCK_SEGMENT || kind == SESSION_OFFER;
}

static void on_own_payload(struct chip_node *node, int64_t kind, const uint8_t *payload, uint32_t length)
{
    struct word_order order;
    if (kind == BLOCK_SEGMENT) {
        block_on_segment(node, payload, length);
        return;
    }
    if (!word_read(payload, length, &order)) {
        return;
    }
    if (order.kind == WORDS_COMMAND) {
        on_command(node, &order);
    } else if (order.kind == WORDS_RECEIPT &&
               mail_receipt(&node->kept.mail, order.number, order.content, order.content_length)) {
        node->save_is_due = true;
    }
}

static void on_upper_payload(void *own, const uint8_t *payload, uint32_t length)
{
    struct chip_node *const node = own;
    int64_t kind = 0, target = 0;
    uint32_t content_length = length;
    const uint8_t *const content = seals_content(node, payload, &content_length);
    if (!word_open(content, content_length, &kind, &target)) {
        return;
    }
    if (!goes_down(kind)) {
        said_hear(node, NODE_UPPER, kind, content, content_length); /* for one hop */
    } else if (target != node->identity.tube) {
        (void)relay_pass(node, NODE_LOWER, payload, length);
    } else if (seals_hear(node, payload, length, kind == SESSION_OFFER)) {
        on_own_payload(node, kind, content, content_length);
    }
}

static void on_lower_payload(void *own, const uint8_t *payload, uint32_t length)
{
    struct chip_node *const node = own;
    int64_t kind = 0, target = 0;
    uint32_t content_length = length;
    const uint8_t *const content = seals_content(node, payload, &content_length);
    if (!word_open(content, content_length, &kind, &target) || goes_down(kind)) {
        return;
    }
    if (kind < STATE) {
        said_hear(node, NODE_LOWER, kind, content, content_length);
    } else if (target == BASE && kind == STATE) {
        relay_pass_state(node, payload, length);
    } else if (target == BASE) {
        (void)relay_pass(node, NODE_UPPER, payload, length);
    }
}

/* What the step says */

struct word_origin node_origin(const struct chip_node *node, int64_t number)
{
    struct word_origin origin;
    origin.number = number;
    origin.rig_at = q28_of_us(clock_rig_from_local(&node->clock, node->cycle_us));
    origin.epoch = node->clock.told.epoch;
    origin.tube = node->identity.tube;
    return origin;
}

struct mail_item *node_mail_place(struct chip_node *node, bool is_needed)
{
    return mail_place(&node->kept.mail, &node->ends[NODE_UPPER].link, is_needed);
}

void node_keep(struct chip_node *node, struct mail_item *item, uint32_t length)
{
    mail_keep(item, length, node_ms(node->now_us));
    node->save_is_due = true;
}

static void tell_events(struct chip_node *node)
{
    int64_t numbers[WORDS_EVENT_NUMBERS], code;
    while ((code = borechain_next_event(&node->record, numbers)) != 0) {
        struct mail_item *const item = node_mail_place(node, word_event_is_error(code));
        if (item != NULL) {
            const struct word_origin origin = node_origin(node, item->number);
            node_keep(node, item, word_event(&origin, code, numbers, item->payload, MAIL_ROOM));
        }
    }
}

static void tell_survey(struct chip_node *node, bool is_revised)
{
    const struct borechain_state *const filter = &node->record.filter;
    struct mail_item *const item = node_mail_place(node, true);
    struct word_survey survey;
    struct word_origin origin;
    if (item == NULL) {
        return;
    }
    origin = node_origin(node, item->number);
    survey.flags = node_flags(node, q28_of_us(node->cycle_us), is_dated(node));
    if (!is_revised) {
        node->surveyed.is_said = true;
        node->surveyed.rig_at = origin.rig_at;
        node->surveyed.settle_time = q28_of_us(node->cycle_us) - filter->stopped_at;
        node->surveyed.hops = node->kept.hops;
        node->surveyed.flags = survey.flags & 32u;
    }
    origin.rig_at = node->surveyed.rig_at;
    survey.flags = (uint16_t)((survey.flags & ~32u) | node->surveyed.flags);
    survey.settle_time = node->surveyed.settle_time;
    survey.hops = node->surveyed.hops;
    survey.samples = node->record.config.survey_samples;
    survey.yaw = is_revised ? filter->surveyed_yaw : filter->now_yaw;
    survey.yaw_var = node_yaw_var(is_revised ? filter->surveyed_var : filter->now_P[2][2]);
    survey.systematic_var =
        (is_revised ? node->record.revision.systematic : filter->systematic_var) + node->identity.mount_var;
    node_keep(node, item, word_survey(&origin, &survey, filter, item->payload, MAIL_ROOM));
}

static void announce(struct chip_node *node)
{
    struct mail_item *item;
    node->is_announced = true;
    item = node_mail_place(node, false);
    if (item != NULL) {
        const struct word_origin origin = node_origin(node, item->number);
        node_keep(node, item, word_start(&origin, node->record.filter.now_yaw, node->worth, item->payload, MAIL_ROOM));
    }
}

static void say(struct chip_node *node, int64_t says)
{
    if ((says & SAY_EVENTS) != 0) {
        tell_events(node);
    }
    if ((says & SAY_SURVEY) != 0) {
        tell_survey(node, false);
    }
    if ((says & SAY_REVISION) != 0 && node->surveyed.is_said) {
        tell_survey(node, true);
    }
    if ((says & SAY_STATE) != 0 && node->clock.exchanges > 0u) {
        signals_say_state(node);
    }
}

void node_on_readings(struct chip_node *node, int64_t readings[BORECHAIN_IMUS][NODE_READING], int64_t ended_us)
{
    int64_t moment[8], says;
    const int64_t begun_us = node->cycle_us != 0 && ended_us - node->cycle_us < PERIOD_US * 3 / 2
                                 ? node->cycle_us
                                 : ended_us - PERIOD_US;
    const bool was_still = node->record.filter.still_cycles > 0;
    int64_t stepped;
    node->cycle_us = ended_us;
    node->now_us = ended_us > node->now_us ? ended_us : node->now_us;
    if (is_dated(node) && !node->is_announced) {
        announce(node);
    }
    stepped = is_dated(node) ? clock_take_step(&node->clock) : 0;
    moment[0] = q28_of_us(begun_us);
    moment[1] = q28_of_us(ended_us);
    moment[2] = node->has_neighbour[NODE_UPPER] ? 1 : 0;
    moment[3] = node->kept.hops;
    moment[4] = node_var_q56(node_clock_var(node));
    moment[5] = is_dated(node) ? 1 : 0;
    moment[6] = stepped == CLOCK_UNKNOWN ? NO_NUMBER : q28_of_us(stepped);
    moment[7] = node->clock.exchanges > 0u ? clock_drift_std(&node->clock) * 70369 : 0; /* 1e-9 in Q46 */
    says = borechain_step(&node->record, &node->settings, node->kept.corrections, readings, moment);
    if (says > 0) {
        say(node, says);
        node->save_is_due = node->save_is_due || (was_still && node->record.filter.still_cycles == 0);
    }
    block_on_cycle(node);
}

/* Driven from outside */

bool node_begin(
    struct chip_node *node,
    const uint8_t *image,
    uint32_t image_size,
    const struct node_identity *identity,
    const struct slot_board *flash,
    uint32_t nonce,
    int64_t now_us)
{
    struct chip_end_calls upper = {node, on_upper_payload, on_upper_signals, has_room_below, words_up, NULL, NULL, NULL};
    struct chip_end_calls lower = {node, on_lower_payload, on_lower_signals, has_room_above, words_down, NULL, NULL, NULL};
    memset(node, 0, sizeof *node);
    node->identity = *identity;
    node->flash = flash;
    node->now_us = now_us;
    if (!memory_load(node, image, image_size)) {
        return false;
    }
    node->kept.boots++;
    if (!seals_begin(node, identity->key_page, identity->key_page_size, nonce)) {
        return false;
    }
    seals_join(node, NODE_UPPER, &upper);
    seals_join(node, NODE_LOWER, &lower);
    chip_end_begin(&node->ends[NODE_UPPER], &upper, identity->tube, node->kept.boots, ISOTP_FD, nonce, node_ms(now_us));
    chip_end_begin(
        &node->ends[NODE_LOWER], &lower, identity->tube, node->kept.boots, ISOTP_FD, nonce + 1u, node_ms(now_us));
    mail_resume(&node->kept.mail, node_ms(now_us));
    node->hello_at_ms = node_ms(now_us) - HELLO_EVERY_MS;
    node->ask_at_ms = node_ms(now_us);
    memory_save(node, node_ms(now_us));
    return true;
}

void node_on_frame(
    struct chip_node *node,
    enum node_side side,
    uint32_t identifier,
    const uint8_t *data,
    uint8_t length,
    int64_t now_us)
{
    node->now_us = now_us;
    chip_end_on_frame(&node->ends[side], identifier, data, length, node_ms(now_us));
}

static void follow_links(struct chip_node *node, uint32_t now_ms)
{
    uint32_t side;
    for (side = 0u; side < 2u; side++) {
        if (!link_is_up(&node->ends[side].link, now_ms)) {
            node->has_neighbour[side] = false;
        }
    }
    if (!node->has_neighbour[NODE_UPPER]) {
        relay_drop_states(node);
    }
}

void node_advance(struct chip_node *node, int64_t now_us)
{
    const uint32_t now_ms = node_ms(now_us);
    const uint32_t every = node->refused != 0u ? RETRY_EVERY_MS : SAVE_EVERY_MS;
    node->now_us = now_us;
    follow_links(node, now_ms);
    if (now_ms - node->hello_at_ms >= HELLO_EVERY_MS) {
        node->hello_at_ms = now_ms;
        signals_say_hello(node);
    }
    if ((int32_t)(now_ms - node->ask_at_ms) >= 0 && link_is_up(&node->ends[NODE_UPPER].link, now_ms)) {
        node->ask_at_ms = now_ms + (node->clock.exchanges < BURST ? QUICK_MS : SLOW_MS);
        signals_ask_time(node);
    }
    seals_tell(node);
    if ((node->save_is_due && node->refused == 0u) || now_ms - node->saved_at_ms >= every) {
        memory_save(node, now_ms);
    }
    mail_send(&node->kept.mail, &node->ends[NODE_UPPER].link, now_ms); /* behind the save; a worn flash ends nothing */
    block_advance(node);
}
