/* SLCAN, see slcan_line.h. */
#include "slcan_line.h"

#define BELL 7u
#define END 13u
#define DATA_AT 10u /* letter, eight digits, length code */
#define CLASSIC_LONGEST 8u

static const uint8_t LENGTHS[16] = {0u, 1u, 2u, 3u, 4u, 5u, 6u, 7u, 8u, 12u, 16u, 20u, 24u, 32u, 48u, 64u};
static const uint8_t DIGITS[] = "0123456789ABCDEF";

/* Value of a hexadecimal digit, 16 for none. */
static uint32_t digit(uint8_t byte)
{
    if (byte >= (uint8_t)'0' && byte <= (uint8_t)'9') {
        return (uint32_t)byte - (uint32_t)'0';
    }
    if (byte >= (uint8_t)'A' && byte <= (uint8_t)'F') {
        return (uint32_t)byte - (uint32_t)'A' + 10u;
    }
    if (byte >= (uint8_t)'a' && byte <= (uint8_t)'f') {
        return (uint32_t)byte - (uint32_t)'a' + 10u;
    }
    return 16u;
}

static bool read_frame(const uint8_t *line, uint32_t length, struct slcan_frame *frame)
{
    uint32_t k;
    for (k = 1u; k < length; k++) {
        if (digit(line[k]) > 15u) {
            return false;
        }
    }
    if (length < DATA_AT || digit(line[1]) > 1u) {
        return false;
    }
    frame->length = LENGTHS[digit(line[DATA_AT - 1u])];
    if (length != DATA_AT + 2u * frame->length || (line[0] == (uint8_t)'T' && frame->length > CLASSIC_LONGEST)) {
        return false;
    }
    frame->identifier = 0u;
    for (k = 1u; k < DATA_AT - 1u; k++) {
        frame->identifier = frame->identifier << 4 | digit(line[k]);
    }
    for (k = 0u; k < frame->length; k++) {
        frame->data[k] = (uint8_t)(digit(line[DATA_AT + 2u * k]) << 4 | digit(line[DATA_AT + 2u * k + 1u]));
    }
    return true;
}

static enum slcan_event read_line(const struct slcan_line *line, struct slcan_frame *frame)
{
    const uint8_t letter = line->line[0];
    if (line->is_overlong) {
        return SLCAN_GARBAGE;
    }
    if (line->length == 0u) {
        return SLCAN_DONE;
    }
    if (letter == (uint8_t)'T' || letter == (uint8_t)'D' || letter == (uint8_t)'B') {
        return read_frame(line->line, line->length, frame) ? SLCAN_FRAME : SLCAN_GARBAGE;
    }
    return line->length == 1u && letter == (uint8_t)'Z' ? SLCAN_ACKNOWLEDGED : SLCAN_GARBAGE;
}

enum slcan_event slcan_take(struct slcan_line *line, uint8_t byte, struct slcan_frame *frame)
{
    enum slcan_event event;
    if (byte != END && byte != BELL) {
        if (line->length < SLCAN_LONGEST - 1u) {
            line->line[line->length] = byte;
            line->length++;
        } else {
            line->is_overlong = true;
        }
        return SLCAN_NOTHING;
    }
    event = byte == BELL ? SLCAN_REFUSED : read_line(line, frame);
    line->length = 0u;
    line->is_overlong = false;
    return event;
}

uint32_t slcan_write(const struct slcan_frame *frame, bool is_fd, uint8_t room[SLCAN_LONGEST])
{
    uint32_t code = 0u;
    uint32_t k;
    while (code < 16u && LENGTHS[code] != frame->length) {
        code++;
    }
    if (code == 16u || (!is_fd && frame->length > CLASSIC_LONGEST)) {
        return 0u;
    }
    room[0] = is_fd ? (uint8_t)'B' : (uint8_t)'T';
    for (k = 0u; k < 8u; k++) {
        room[1u + k] = DIGITS[frame->identifier >> (28u - 4u * k) & 15u];
    }
    room[DATA_AT - 1u] = DIGITS[code];
    for (k = 0u; k < frame->length; k++) {
        room[DATA_AT + 2u * k] = DIGITS[frame->data[k] >> 4];
        room[DATA_AT + 2u * k + 1u] = DIGITS[frame->data[k] & 15u];
    }
    room[DATA_AT + 2u * frame->length] = END;
    return DATA_AT + 2u * frame->length + 1u;
}
