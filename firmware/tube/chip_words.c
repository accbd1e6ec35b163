/* Payloads of a chip, see chip_words.h. Keys are those of the schema, in its order: a receipt names the very bytes. */
#include "chip_words.h"

#include <stddef.h>
#include <string.h>

#include "borechain_events.h"
#include "msgpack.h"
#include "word_envelope.h"

#define BASE 251
#define REPLY 9
#define EVENT 10
#define SURVEY 6
#define DATED 4 /* version of the schema in which an epoch is said */
#define TIME_Q 28
#define VAR_Q 56
#define FORCE_Q 26
#define NUMBER_Q 24
#define TURN_Q 60
#define TURN INT64_C(1686629713) /* 2 pi by 2^32, in Q60 */
#define DEGREES_Q 24
#define NO_NUMBER (INT64_C(1) << 60)
#define GRAVITY 980665 /* 1e-5 m/s^2 */

void word_envelope(struct pack_writer *to, int version, int kind, uint8_t tube, int64_t number)
{
    pack_map(to, 6u);
    pack_text(to, "v");
    pack_integer(to, version);
    pack_text(to, "k");
    pack_integer(to, kind);
    pack_text(to, "o");
    pack_integer(to, tube);
    pack_text(to, "t");
    pack_integer(to, BASE);
    pack_text(to, "s");
    pack_integer(to, number);
    pack_text(to, "b");
}

void word_integer(struct pack_writer *to, const char *key, int64_t value)
{
    pack_text(to, key);
    pack_integer(to, value);
}

static void key_of_float(struct pack_writer *to, const char *key, int64_t value, int32_t q)
{
    pack_text(to, key);
    pack_float(to, value, q);
}

/* An origin's version, and its number of fields beyond others. */
static uint32_t dated(const struct word_origin *origin)
{
    return origin->epoch != 0u ? 1u : 0u;
}

static void begin(struct pack_writer *to, const struct word_origin *origin, int kind, uint32_t fields)
{
    word_envelope(to, dated(origin) != 0u ? DATED : WORDS_PLAIN, kind, origin->tube, origin->number);
    pack_map(to, fields + dated(origin));
    word_integer(to, "t", origin->tube);
    word_integer(to, "s", origin->number);
    key_of_float(to, "at", origin->rig_at, TIME_Q);
}

void word_end(struct pack_writer *to, const struct word_origin *origin)
{
    if (dated(origin) != 0u) {
        word_integer(to, "ep", origin->epoch);
    }
}

/* Times a factor in steps of 1e-5, rounded down: parts that do not overflow. */
static int64_t times(int64_t value, int64_t factor)
{
    return value / 100000 * factor + value % 100000 * factor / 100000;
}

static void pack_forces(struct pack_writer *to, const struct borechain_state *filter)
{
    uint32_t i, j;
    pack_array(to, 1u);
    pack_array(to, 2u);
    pack_array(to, 3u);
    for (i = 0u; i < 3u; i++) {
        pack_float(to, times(filter->survey_force[i] * 4096, GRAVITY), FORCE_Q + 12);
    }
    pack_array(to, 3u);
    for (i = 0u; i < 3u; i++) {
        pack_array(to, 3u);
        for (j = 0u; j < 3u; j++) {
            pack_float(to, times(times(filter->survey_force_cov[i][j], GRAVITY), GRAVITY), 2 * FORCE_Q);
        }
    }
}

uint32_t word_survey(
    const struct word_origin *origin,
    const struct word_survey *survey,
    const struct borechain_state *filter,
    uint8_t *room,
    uint32_t size)
{
    struct pack_writer to = {room, size, 0u};
    begin(&to, origin, SURVEY, 11u);
    word_integer(&to, "h", survey->hops);
    pack_text(&to, "i");
    pack_forces(&to, filter);
    key_of_float(&to, "y", (int64_t)survey->yaw * TURN, TURN_Q);
    key_of_float(&to, "yv", survey->yaw_var, VAR_Q);
    key_of_float(&to, "sv", survey->systematic_var, VAR_Q);
    word_integer(&to, "n", survey->samples);
    key_of_float(&to, "st", survey->settle_time, TIME_Q);
    word_integer(&to, "f", survey->flags);
    word_end(&to, origin);
    return packed_length(&to);
}

static const struct event_line *line_of(int64_t code)
{
    return code > 0 && code < EVENT_CODES && event_lines[code].name != NULL ? &event_lines[code] : NULL;
}

bool word_event_is_error(int64_t code)
{
    const struct event_line *const line = line_of(code);
    return line != NULL && line->severity == 2u;
}

void word_begin_event(struct pack_writer *to, const struct word_origin *origin, int severity, const char *name)
{
    begin(to, origin, EVENT, 6u);
    word_integer(to, "v", severity);
    pack_text(to, "c");
    pack_text(to, name);
    pack_text(to, "a");
}

static void pack_argument(struct pack_writer *to, const struct event_argument *argument, int64_t number)
{
    const int64_t whole = number >> NUMBER_Q;
    pack_text(to, argument->name);
    if (argument->kind == EVENT_FLOAT) {
        pack_float(to, number, NUMBER_Q);
    } else if (argument->kind == EVENT_WHOLE) {
        pack_integer(to, whole);
    } else if (argument->kind == EVENT_FLAG) {
        pack_bool(to, number != 0);
    } else {
        pack_text(to, whole >= 0 && whole < argument->count ? argument->words[whole] : "");
    }
}

uint32_t word_event(
    const struct word_origin *origin,
    int64_t code,
    const int64_t numbers[WORDS_EVENT_NUMBERS],
    uint8_t *room,
    uint32_t size)
{
    struct pack_writer to = {room, size, 0u};
    const struct event_line *const line = line_of(code);
    uint32_t k, told = 0u;
    if (line == NULL) {
        return 0u;
    }
    for (k = 0u; k < line->count; k++) {
        told += numbers[k] != NO_NUMBER ? 1u : 0u;
    }
    word_begin_event(&to, origin, line->severity, line->name);
    pack_map(&to, told);
    for (k = 0u; k < line->count; k++) {
        if (numbers[k] != NO_NUMBER) {
            pack_argument(&to, &line->arguments[k], numbers[k]);
        }
    }
    word_end(&to, origin);
    return packed_length(&to);
}

uint32_t word_start(const struct word_origin *origin, uint32_t yaw, int64_t worth, uint8_t *room, uint32_t size)
{
    struct pack_writer to = {room, size, 0u};
    word_begin_event(&to, origin, 0, worth < 0 ? "booted" : "restored");
    pack_map(&to, worth < 0 ? 1u : 2u);
    pack_text(&to, "yaw_deg");
    pack_float(&to, (int64_t)yaw * 360 >> (32 - DEGREES_Q), DEGREES_Q);
    if (worth >= 0) {
        pack_text(&to, "worth_h");
        pack_float(&to, worth / 3600, TIME_Q);
    }
    word_end(&to, origin);
    return packed_length(&to);
}

uint32_t word_reply(
    uint8_t tube,
    int64_t order,
    bool is_done,
    const char *detail,
    uint8_t *room,
    uint32_t size)
{
    struct pack_writer to = {room, size, 0u};
    word_envelope(&to, WORDS_PLAIN, REPLY, tube, order);
    pack_map(&to, 4u);
    word_integer(&to, "t", tube);
    word_integer(&to, "s", order);
    pack_text(&to, "d");
    pack_bool(&to, is_done);
    pack_text(&to, "x");
    pack_text(&to, detail);
    return packed_length(&to);
}

bool word_body(const uint8_t *payload, uint32_t length, int64_t *kind, int64_t *target, struct pack_reader *body)
{
    struct pack_reader from = {payload, length};
    uint32_t fields, k, key_length, found = 0u;
    const uint8_t *key;
    if (!read_map(&from, &fields)) {
        return false;
    }
    for (k = 0u; k < fields; k++) {
        bool is_read;
        if (!read_text(&from, &key, &key_length)) {
            return false;
        }
        if (text_is(key, key_length, "k")) {
            is_read = read_integer(&from, kind);
            found |= 1u;
        } else if (text_is(key, key_length, "t")) {
            is_read = read_integer(&from, target);
            found |= 2u;
        } else {
            if (text_is(key, key_length, "b")) {
                *body = from;
                found |= 4u;
            }
            is_read = read_past(&from);
        }
        if (!is_read) {
            return false;
        }
    }
    return found == 7u && from.left == 0u;
}

bool word_open(const uint8_t *payload, uint32_t length, int64_t *kind, int64_t *target)
{
    struct pack_reader body;
    return word_body(payload, length, kind, target, &body);
}

static bool read_arguments(struct pack_reader *from, struct word_order *order)
{
    uint32_t fields, k, key_length;
    const uint8_t *key;
    if (!read_map(from, &fields)) {
        return false;
    }
    for (k = 0u; k < fields; k++) {
        bool is_read;
        if (!read_text(from, &key, &key_length)) {
            return false;
        }
        if (text_is(key, key_length, "method")) {
            is_read = read_text(from, &order->method, &order->method_length);
        } else if (text_is(key, key_length, "turns")) {
            is_read = read_quantity(from, NUMBER_Q, &order->turns);
        } else if (text_is(key, key_length, "seconds")) {
            is_read = read_quantity(from, TIME_Q, &order->seconds);
        } else {
            is_read = read_past(from);
        }
        if (!is_read) {
            return false;
        }
    }
    return true;
}

bool word_read(const uint8_t *payload, uint32_t length, struct word_order *order)
{
    struct pack_reader from;
    uint32_t fields, k, key_length;
    const uint8_t *key;
    bool is_numbered = false;
    memset(order, 0, sizeof *order);
    if (!word_body(payload, length, &order->kind, &order->target, &from) || !read_map(&from, &fields)) {
        return false;
    }
    for (k = 0u; k < fields; k++) {
        bool is_read;
        if (!read_text(&from, &key, &key_length)) {
            return false;
        }
        if (text_is(key, key_length, "s")) {
            is_read = is_numbered = read_integer(&from, &order->number);
        } else if (text_is(key, key_length, "n")) {
            is_read = read_text(&from, &order->name, &order->name_length);
        } else if (text_is(key, key_length, "c")) {
            is_read = read_binary(&from, &order->content, &order->content_length);
        } else if (text_is(key, key_length, "a")) {
            is_read = read_arguments(&from, order);
        } else {
            is_read = read_past(&from);
        }
        if (!is_read) {
            return false;
        }
    }
    return is_numbered && (order->kind != WORDS_COMMAND || order->name != NULL);
}
