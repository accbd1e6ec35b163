/* Frames of a joint's link: the few forms of msgpack that they have, see hop_link.h. */
#include "big_endian.h"
#include "crc32.h"
#include "hop_link.h"

#include <string.h>

#define VERSION 1u
#define FIELDS 8u
#define CHECKSUM 4u
#define NUMBERS UINT64_C(9007199254740992) /* an entry's number is below 2^53 */

static bool take_bytes(struct link_entries *from, uint32_t bytes, uint64_t *value)
{
    return take_big_endian(&from->at, &from->left, bytes, value);
}

/* A whole number that is not negative, in whatever of its forms. */
static bool take_number(struct link_entries *from, uint64_t *value)
{
    uint64_t form;
    if (!take_bytes(from, 1u, &form)) {
        return false;
    }
    if (form < 0x80u) {
        *value = form;
        return true;
    }
    if (form >= 0xCCu && form <= 0xCFu) {
        return take_bytes(from, 1u << (form - 0xCCu), value);
    }
    if (form >= 0xD0u && form <= 0xD3u) {
        const uint32_t bytes = 1u << (form - 0xD0u);
        return take_bytes(from, bytes, value) && (*value >> (8u * bytes - 1u)) == 0u;
    }
    return false;
}

static bool take_array(struct link_entries *from, uint64_t *count)
{
    uint64_t form;
    if (!take_bytes(from, 1u, &form)) {
        return false;
    }
    if (form >= 0x90u && form <= 0x9Fu) {
        *count = form & 0x0Fu;
        return true;
    }
    return (form == 0xDCu || form == 0xDDu) && take_bytes(from, form == 0xDCu ? 2u : 4u, count);
}

static bool take_binary(struct link_entries *from, const uint8_t **payload, uint32_t *length)
{
    uint64_t form;
    uint64_t bytes;
    if (!take_bytes(from, 1u, &form) || form < 0xC4u || form > 0xC6u ||
        !take_bytes(from, 1u << (form - 0xC4u), &bytes) || bytes > from->left) {
        return false;
    }
    *payload = from->at;
    *length = (uint32_t)bytes;
    from->at += bytes;
    from->left -= (uint32_t)bytes;
    return true;
}

bool link_next_entry(struct link_entries *entries, struct link_entry *entry)
{
    uint64_t parts;
    if (entries->count == 0u || !take_array(entries, &parts) || parts != 2u ||
        !take_number(entries, &entry->number) || entry->number >= NUMBERS ||
        !take_binary(entries, &entry->payload, &entry->length)) {
        return false;
    }
    entries->count--;
    return true;
}

static bool take_header(struct link_entries *from, struct link_header *header)
{
    uint64_t version;
    uint64_t fields;
    return take_array(from, &fields) && fields == FIELDS && take_number(from, &version) && version == VERSION &&
           take_number(from, &header->sender) && take_number(from, &header->epoch) &&
           take_number(from, &header->number) && take_number(from, &header->peer_epoch) &&
           take_number(from, &header->acknowledged) && take_number(from, &header->mask);
}

bool link_parse(const uint8_t *frame, uint32_t length, struct link_header *header, struct link_entries *entries)
{
    struct link_entries walked;
    struct link_entry entry;
    uint64_t count;
    uint32_t checksum;
    if (length <= CHECKSUM + 1u || length > LINK_LARGEST) {
        return false;
    }
    checksum = (uint32_t)frame[0] | (uint32_t)frame[1] << 8 | (uint32_t)frame[2] << 16 | (uint32_t)frame[3] << 24;
    entries->at = &frame[CHECKSUM];
    entries->left = length - CHECKSUM;
    if (crc32_of(0u, entries->at, entries->left) != checksum || !take_header(entries, header) ||
        !take_array(entries, &count) || count > entries->left) {
        return false;
    }
    entries->count = (uint32_t)count;
    walked = *entries;
    while (link_next_entry(&walked, &entry)) {
    }
    return walked.count == 0u && walked.left == 0u;
}

/* A frame as it is written; `length` goes on counting where the room has ended. */
struct written {
    uint8_t *room;
    uint32_t size;
    uint32_t length;
};

static void put_bytes(struct written *to, const uint8_t *bytes, uint32_t length)
{
    if (length > 0u && to->length <= to->size && length <= to->size - to->length) {
        memcpy(&to->room[to->length], bytes, length);
    }
    to->length += length;
}

static void put_form(struct written *to, uint32_t form, uint64_t value, uint32_t bytes)
{
    uint8_t content[9];
    uint32_t k;
    content[0] = (uint8_t)form;
    for (k = 0u; k < bytes; k++) {
        content[bytes - k] = (uint8_t)(value >> (8u * k) & 0xFFu);
    }
    put_bytes(to, content, 1u + bytes);
}

static void put_number(struct written *to, uint64_t value)
{
    if (value < 0x80u) {
        put_form(to, (uint32_t)value, 0u, 0u);
    } else if (value <= UINT8_MAX) {
        put_form(to, 0xCCu, value, 1u);
    } else if (value <= UINT16_MAX) {
        put_form(to, 0xCDu, value, 2u);
    } else if (value <= UINT32_MAX) {
        put_form(to, 0xCEu, value, 4u);
    } else {
        put_form(to, 0xCFu, value, 8u);
    }
}

static void put_array(struct written *to, uint32_t count)
{
    if (count < 16u) {
        put_form(to, 0x90u | count, 0u, 0u);
    } else {
        put_form(to, 0xDCu, count, 2u);
    }
}

static void put_entry(struct written *to, const struct link_entry *entry)
{
    const uint32_t length = entry->head_length + entry->length;
    put_array(to, 2u);
    put_number(to, entry->number);
    if (length <= UINT8_MAX) {
        put_form(to, 0xC4u, length, 1u);
    } else {
        put_form(to, 0xC5u, length, 2u);
    }
    put_bytes(to, entry->head, entry->head_length);
    put_bytes(to, entry->payload, entry->length);
}

uint32_t link_pack(
    const struct link_header *header,
    const struct link_entry *entries,
    uint32_t count,
    uint8_t *room,
    uint32_t size)
{
    const uint64_t numbers[] = {VERSION, header->sender, header->epoch, header->number, header->peer_epoch,
                                header->acknowledged, header->mask};
    struct written to;
    uint32_t checksum;
    uint32_t k;
    to.room = room;
    to.size = size;
    to.length = CHECKSUM;
    put_array(&to, FIELDS);
    for (k = 0u; k < sizeof numbers / sizeof numbers[0]; k++) {
        put_number(&to, numbers[k]);
    }
    put_array(&to, count);
    for (k = 0u; k < count; k++) {
        put_entry(&to, &entries[k]);
    }
    if (to.length > size || to.length > LINK_LARGEST) {
        return 0u;
    }
    checksum = crc32_of(0u, &room[CHECKSUM], to.length - CHECKSUM);
    for (k = 0u; k < CHECKSUM; k++) {
        room[k] = (uint8_t)(checksum >> (8u * k) & 0xFFu);
    }
    return to.length;
}
