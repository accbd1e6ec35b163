/* Two slots of flash, see two_slots.h. */
#include "two_slots.h"

#include "crc32.h"

#include <string.h>

#define MAGIC UINT32_C(0x32534342) /* "BCS2" */
#define SUMMED 12u                 /* bytes of the header under the CRC */
#define CHUNK 64u

static void put_u32(uint8_t *data, uint32_t value)
{
    data[0] = (uint8_t)(value & 0xFFu);
    data[1] = (uint8_t)(value >> 8 & 0xFFu);
    data[2] = (uint8_t)(value >> 16 & 0xFFu);
    data[3] = (uint8_t)(value >> 24);
}

static uint32_t get_u32(const uint8_t *data)
{
    return (uint32_t)data[0] | (uint32_t)data[1] << 8 | (uint32_t)data[2] << 16 | (uint32_t)data[3] << 24;
}

/* Whether a slot is whole; then its generation and length. */
static bool is_whole(const struct slot_board *board, uint32_t slot, struct slot_found *found)
{
    uint8_t header[SLOT_HEADER];
    uint8_t chunk[CHUNK];
    uint32_t crc;
    uint32_t at = 0u;
    board->read(board->own, slot, 0u, header, SLOT_HEADER);
    found->slot = slot;
    found->generation = get_u32(&header[4]);
    found->length = get_u32(&header[8]);
    if (get_u32(header) != MAGIC || found->length > board->size - SLOT_HEADER) {
        return false;
    }
    crc = crc32_of(0u, header, SUMMED);
    while (at < found->length) {
        const uint32_t part = found->length - at < CHUNK ? found->length - at : CHUNK;
        board->read(board->own, slot, SLOT_HEADER + at, chunk, part);
        crc = crc32_of(crc, chunk, part);
        at += part;
    }
    return crc == get_u32(&header[SUMMED]);
}

void slots_find(const struct slot_board *board, struct slot_found *found)
{
    struct slot_found first;
    struct slot_found second;
    const bool has_first = is_whole(board, 0u, &first);
    const bool has_second = is_whole(board, 1u, &second);
    memset(found, 0, sizeof *found);
    found->slot = SLOT_NONE;
    /* generations may run over: the newer one is less than half of all ahead */
    if (has_first && !(has_second && second.generation - first.generation - 1u < UINT32_MAX / 2u)) {
        *found = first;
    } else if (has_second) {
        *found = second;
    }
}

void slots_load(const struct slot_board *board, const struct slot_found *found, uint8_t *content)
{
    if (found->slot != SLOT_NONE) {
        board->read(board->own, found->slot, SLOT_HEADER, content, found->length);
    }
}

static bool write_words(const struct slot_board *board, uint32_t slot, uint32_t at, const uint8_t *data, uint32_t length)
{
    while (length > 0u) {
        uint8_t word[SLOT_WORD];
        const uint32_t part = length < SLOT_WORD ? length : SLOT_WORD;
        memset(word, 0xFF, SLOT_WORD);
        memcpy(word, data, part);
        if (!board->write(board->own, slot, at, word)) {
            return false;
        }
        at += SLOT_WORD;
        data += part;
        length -= part;
    }
    return true;
}

enum slot_answer slots_save(
    const struct slot_board *board,
    struct slot_found *found,
    const uint8_t *content,
    uint32_t length)
{
    const uint32_t slot = found->slot == 0u ? 1u : 0u;
    const uint32_t generation = found->slot == SLOT_NONE ? 1u : found->generation + 1u;
    struct slot_found written;
    uint8_t header[SLOT_HEADER];
    if (length > board->size - SLOT_HEADER) {
        return SLOT_TOO_LONG;
    }
    put_u32(&header[0], MAGIC);
    put_u32(&header[4], generation);
    put_u32(&header[8], length);
    put_u32(&header[SUMMED], crc32_of(crc32_of(0u, header, SUMMED), content, length));
    if (!board->erase(board->own, slot) || !write_words(board, slot, SLOT_HEADER, content, length) ||
        !write_words(board, slot, 0u, header, SLOT_HEADER)) {
        return SLOT_WORN;
    }
    /* read back; a flash that is locked keeps what it had, of another generation */
    if (!is_whole(board, slot, &written) || written.generation != generation || written.length != length) {
        return SLOT_WORN;
    }
    *found = written;
    return SLOT_SAVED;
}
