/* A chip's node on this machine for its tests: one board with its flash in memory, whose power fails after so many words. */
#include <setjmp.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "chip_node.h"
#include "node_memory.h"

#define SLOT_SIZE 0x8000u /* of eight IMUs */

static struct chip_node node;
static uint8_t flash[2][SLOT_SIZE];
static jmp_buf cut;
static long words_left = -1;
static bool is_worn;
static uint8_t block_key[BLOCK_KEY_SIZE];
static bool has_key;
static uint8_t key_page[9000];
static uint32_t key_page_size;

static void spend(void)
{
    if (words_left == 0) {
        words_left = -1;
        longjmp(cut, 1);
    }
    words_left -= words_left > 0;
}

static bool erase(void *own, uint32_t slot)
{
    (void)own;
    spend();
    memset(flash[slot], 0xFF, SLOT_SIZE);
    return !is_worn;
}

static bool write_word(void *own, uint32_t slot, uint32_t at, const uint8_t word[SLOT_WORD])
{
    (void)own;
    spend();
    memcpy(&flash[slot][at], word, SLOT_WORD);
    return true;
}

static void read_bytes(void *own, uint32_t slot, uint32_t at, uint8_t *into, uint32_t length)
{
    (void)own;
    memcpy(into, &flash[slot][at], length);
}

static const struct slot_board board = {NULL, SLOT_SIZE, erase, write_word, read_bytes};

void shim_clear(void)
{
    memset(flash, 0xFF, sizeof flash);
}

/* The key of its blocks; NULL: it has none. */
void shim_key(const uint8_t *key)
{
    has_key = key != NULL;
    if (has_key) {
        memcpy(block_key, key, sizeof block_key);
    }
}

/* The page of keys of its seals; of no length: it has none. */
void shim_page(const uint8_t *page, uint32_t size)
{
    key_page_size = size;
    memcpy(key_page, page, size);
}

void shim_wear(int worn)
{
    is_worn = worn != 0;
}

void shim_power(long words)
{
    words_left = words;
}

int shim_begin(const uint8_t *image, uint32_t size, uint8_t tube, int64_t mount_var, uint32_t nonce, int64_t now_us)
{
    struct node_identity identity;
    identity.tube = tube;
    identity.mount_var = mount_var;
    identity.block_key = has_key ? block_key : NULL;
    identity.key_page = key_page_size > 0u ? key_page : NULL;
    identity.key_page_size = key_page_size;
    if (setjmp(cut) != 0) {
        return -1;
    }
    return node_begin(&node, image, size, &identity, &board, nonce, now_us);
}

/* These answer -1 where the power has failed. */
int shim_readings(int64_t *readings, int64_t now_us)
{
    if (setjmp(cut) != 0) {
        return -1;
    }
    node_on_readings(&node, (int64_t(*)[NODE_READING])readings, now_us);
    return 0;
}

int shim_frame(int side, uint32_t identifier, const uint8_t *data, uint8_t length, int64_t now_us)
{
    if (setjmp(cut) != 0) {
        return -1;
    }
    node_on_frame(&node, (enum node_side)side, identifier, data, length, now_us);
    return 0;
}

int shim_advance(int64_t now_us)
{
    if (setjmp(cut) != 0) {
        return -1;
    }
    node_advance(&node, now_us);
    return 0;
}

uint8_t shim_next(int side, uint32_t *identifier, uint8_t *data, int64_t now_us)
{
    return chip_end_next_frame(&node.ends[side], identifier, data, (uint32_t)(now_us / 1000));
}

void shim_acknowledged(int side)
{
    chip_end_on_acknowledged(&node.ends[side]);
}

/* What the tests look at. */
int64_t shim_number(int which)
{
    switch (which) {
    case 0:
        return node.clock.exchanges;
    case 1:
        return node.ends[0].wrong;
    case 2:
        return node.ends[1].wrong;
    case 3:
        return node.kept.boots;
    case 4:
        return node.kept.mail.next_number;
    case 5:
        return node.record.filter.overflows;
    case 6:
        return (int64_t)offsetof(struct chip_node, record) + (int64_t)offsetof(struct borechain_node, cycles);
    case 7:
        return node.kept.block.version;
    case 8:
        return node.update.untrusted;
    case 9:
        return node.kept.next_answer;
    default:
        return which >= 100 ? (int64_t)node.seals.counts.count[which - 100] : -1;
    }
}

void shim_resume(struct borechain_node *record, const struct borechain_config *config)
{
    memory_resume(record, config);
}

void shim_corrections(struct borechain_parameters *corrections)
{
    *corrections = node.kept.corrections[0];
}
