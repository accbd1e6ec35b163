/* The part of msgpack that payloads are made of, see msgpack.h. */
#include "msgpack.h"

#include <string.h>

#include "big_endian.h"

#define MOST_NESTED 16u
#define HELD (INT64_C(1) << 62)

static void put(struct pack_writer *to, uint64_t value, uint32_t bytes)
{
    while (bytes > 0u) {
        bytes--;
        if (to->length < to->size) {
            to->room[to->length] = (uint8_t)(value >> (8u * bytes) & 0xFFu);
        }
        to->length++;
    }
}

void pack_map(struct pack_writer *to, uint32_t count)
{
    put(to, 0x80u | count, 1u);
}

void pack_long_map(struct pack_writer *to, uint32_t count)
{
    put(to, 0xDEu, 1u);
    put(to, count, 2u);
}

void pack_array(struct pack_writer *to, uint32_t count)
{
    put(to, 0x90u | count, 1u);
}

/* Bytes of a number of 8, 16, 32 or 64 bits, of which so many are in use; the exponent of two of them. */
static uint32_t width_of(uint64_t value)
{
    return value < 0x100u ? 0u : value < 0x10000u ? 1u : value < UINT64_C(0x100000000) ? 2u : 3u;
}

void pack_integer(struct pack_writer *to, int64_t value)
{
    const uint64_t bits = (uint64_t)value;
    if (value >= -32 && value < 128) {
        put(to, bits & 0xFFu, 1u);
    } else if (value > 0) {
        const uint32_t width = width_of(bits);
        put(to, 0xCCu + width, 1u);
        put(to, bits, 1u << width);
    } else {
        const uint32_t width = width_of(2u * (uint64_t)(-(value + 1)));
        put(to, 0xD0u + width, 1u);
        put(to, bits, 1u << width);
    }
}

static uint32_t length_of(const char *text)
{
    uint32_t length = 0u;
    while (text[length] != '\0') {
        length++;
    }
    return length;
}

void pack_text(struct pack_writer *to, const char *text)
{
    const uint32_t length = length_of(text);
    uint32_t k;
    if (length < 32u) {
        put(to, 0xA0u | length, 1u);
    } else {
        put(to, 0xD9u, 1u);
        put(to, length, 1u);
    }
    for (k = 0u; k < length; k++) {
        put(to, (uint8_t)text[k], 1u);
    }
}

void pack_binary(struct pack_writer *to, const uint8_t *bytes, uint32_t length)
{
    uint32_t k;
    put(to, 0xC4u, 1u);
    put(to, length, 1u);
    for (k = 0u; k < length; k++) {
        put(to, bytes[k], 1u);
    }
}

void pack_bool(struct pack_writer *to, bool value)
{
    put(to, value ? 0xC3u : 0xC2u, 1u);
}

void pack_bits(struct pack_writer *to, uint64_t bits)
{
    put(to, 0xCBu, 1u);
    put(to, bits, 8u);
}

uint64_t bits_of_quantity(int64_t value, int32_t q)
{
    uint64_t magnitude = value < 0 ? (uint64_t)(-(value + 1)) + 1u : (uint64_t)value;
    const uint64_t sign = value < 0 ? UINT64_C(1) << 63 : 0u;
    int32_t exponent = 1023 + 52 - q;
    if (magnitude == 0u) {
        return 0u;
    }
    while (magnitude < UINT64_C(1) << 52) {
        magnitude <<= 1;
        exponent--;
    }
    while (magnitude >= UINT64_C(1) << 54) {
        magnitude = magnitude >> 1 | (magnitude & 1u); /* what was cut off still counts */
        exponent++;
    }
    if (magnitude >= UINT64_C(1) << 53) {
        magnitude = (magnitude >> 1) + ((magnitude & 3u) == 3u ? 1u : 0u);
        exponent++;
    }
    return sign | (((uint64_t)exponent << 52) + (magnitude - (UINT64_C(1) << 52)));
}

void pack_float(struct pack_writer *to, int64_t value, int32_t q)
{
    pack_bits(to, bits_of_quantity(value, q));
}

uint32_t packed_length(const struct pack_writer *to)
{
    return to->length <= to->size ? to->length : 0u;
}

static bool take(struct pack_reader *from, uint32_t bytes, uint64_t *value)
{
    return take_big_endian(&from->at, &from->left, bytes, value);
}

bool read_map(struct pack_reader *from, uint32_t *count)
{
    if (from->left == 0u || (from->at[0] & 0xF0u) != 0x80u) {
        return false;
    }
    *count = from->at[0] & 0x0Fu;
    from->at++;
    from->left--;
    return true;
}

bool read_integer(struct pack_reader *from, int64_t *value)
{
    struct pack_reader ahead = *from;
    uint64_t form, bits;
    if (!take(&ahead, 1u, &form)) {
        return false;
    }
    if (form < 0x80u || form >= 0xE0u) {
        *value = form < 0x80u ? (int64_t)form : (int64_t)form - 256;
    } else if (form >= 0xCCu && form <= 0xD3u) {
        const uint32_t bytes = 1u << (form & 3u);
        if (!take(&ahead, bytes, &bits)) {
            return false;
        }
        if (form < 0xD0u) {
            if (bits > (uint64_t)INT64_MAX) {
                return false;
            }
            *value = (int64_t)bits;
        } else {
            const uint64_t half = UINT64_C(1) << (8u * bytes - 1u);
            *value = (int64_t)((bits ^ half) - half);
        }
    } else {
        return false;
    }
    *from = ahead;
    return true;
}

/* Head of a text or of bytes, whose short form is `fix` and whose others begin at `first`. */
static bool read_run(struct pack_reader *from, bool is_text, const uint8_t **run, uint32_t *length)
{
    struct pack_reader ahead = *from;
    const uint32_t first = is_text ? 0xD9u : 0xC4u;
    uint64_t form, bytes;
    if (!take(&ahead, 1u, &form)) {
        return false;
    }
    if (is_text && form >= 0xA0u && form <= 0xBFu) {
        bytes = form & 0x1Fu;
    } else if (form < first || form > first + 2u || !take(&ahead, 1u << (form - first), &bytes)) {
        return false;
    }
    if (bytes > ahead.left) {
        return false;
    }
    *run = ahead.at;
    *length = (uint32_t)bytes;
    ahead.at += bytes;
    ahead.left -= (uint32_t)bytes;
    *from = ahead;
    return true;
}

bool read_text(struct pack_reader *from, const uint8_t **text, uint32_t *length)
{
    return read_run(from, true, text, length);
}

bool read_binary(struct pack_reader *from, const uint8_t **bytes, uint32_t *length)
{
    return read_run(from, false, bytes, length);
}

int64_t quantity_of_bits(uint64_t bits, int32_t q)
{
    const int32_t exponent = (int32_t)(bits >> 52 & 0x7FFu);
    const uint64_t mantissa = (bits & ((UINT64_C(1) << 52) - 1u)) | (exponent == 0 ? 0u : UINT64_C(1) << 52);
    const int32_t places = (exponent == 0 ? 1 : exponent) - 1023 - 52 + q;
    int64_t made;
    if (places > 9) {
        made = mantissa == 0u ? 0 : HELD;
    } else if (places >= 0) {
        made = (int64_t)(mantissa << places);
    } else if (places < -54) {
        made = 0;
    } else {
        made = (int64_t)((mantissa >> (-places - 1)) + 1u) >> 1;
    }
    return bits >> 63 != 0u ? -made : made;
}

bool read_quantity(struct pack_reader *from, int32_t q, int64_t *value)
{
    struct pack_reader ahead = *from;
    uint64_t form, bits;
    int64_t whole;
    if (take(&ahead, 1u, &form) && form == 0xCBu && take(&ahead, 8u, &bits)) {
        if ((bits >> 52 & 0x7FFu) == 0x7FFu) {
            return false;
        }
        *value = quantity_of_bits(bits, q);
        *from = ahead;
        return true;
    }
    ahead = *from;
    if (!read_integer(&ahead, &whole) || whole > HELD >> q || whole < -(HELD >> q)) {
        return false;
    }
    *value = whole * (INT64_C(1) << q);
    *from = ahead;
    return true;
}

bool read_bits(struct pack_reader *from, uint64_t *bits)
{
    struct pack_reader ahead = *from;
    uint64_t form;
    int64_t whole;
    if (take(&ahead, 1u, &form) && form == 0xCBu && take(&ahead, 8u, bits) && (*bits >> 52 & 0x7FFu) != 0x7FFu) {
        *from = ahead;
        return true;
    }
    if (!read_integer(from, &whole)) {
        return false;
    }
    *bits = bits_of_quantity(whole, 0);
    return true;
}

/* Values that follow the head of one, and its own bytes; false where no value begins so. */
static bool read_head(struct pack_reader *from, uint32_t *values)
{
    const uint8_t *run;
    uint32_t length;
    int64_t whole;
    uint64_t form, count;
    *values = 0u;
    if (read_text(from, &run, &length) || read_binary(from, &run, &length) || read_integer(from, &whole)) {
        return true;
    }
    if (!take(from, 1u, &form)) {
        return false;
    }
    if (form >= 0x80u && form <= 0x9Fu) {
        *values = (uint32_t)(form & 0x0Fu) * (form < 0x90u ? 2u : 1u);
        return true;
    }
    if (form == 0xCAu || form == 0xCBu) {
        return take(from, form == 0xCAu ? 4u : 8u, &count);
    }
    if (form >= 0xDCu && form <= 0xDFu && take(from, (form & 1u) == 0u ? 2u : 4u, &count) && count <= from->left) {
        *values = (uint32_t)count * (form >= 0xDEu ? 2u : 1u);
        return true;
    }
    return form == 0xC0u || form == 0xC2u || form == 0xC3u;
}

bool read_past(struct pack_reader *from)
{
    uint32_t due[MOST_NESTED], depth = 1u, values;
    due[0] = 1u;
    while (depth > 0u) {
        if (due[depth - 1u] == 0u) {
            depth--;
            continue;
        }
        due[depth - 1u]--;
        if (!read_head(from, &values)) {
            return false;
        }
        if (values > 0u) {
            if (depth == MOST_NESTED) {
                return false;
            }
            due[depth] = values;
            depth++;
        }
    }
    return true;
}

bool text_is(const uint8_t *text, uint32_t length, const char *wanted)
{
    return length == length_of(wanted) && memcmp(text, wanted, length) == 0;
}
