/* Keys of a tube in a page of its board's flash, as `borechain firmware provision --keys` writes them.
 *
 * The page: "BCKY", format, tube, count of generations, a byte of nothing; of each generation, the oldest first, its
 * number, seven bytes of nothing, a bit for each address with which it has a key of a joint, the keys of the end, of calls
 * and of measurements, and those of joints by address; at last the CRC-32 of all that.
 */
#ifndef BORECHAIN_KEY_PAGE_H
#define BORECHAIN_KEY_PAGE_H

#include <stdbool.h>
#include <stdint.h>

#define KEY_PAGE_HEAD 8u
#define KEY_PAGE_ADDRESSES 252u
#define KEY_PAGE_GENERATION (8u + 32u + 16u * (3u + KEY_PAGE_ADDRESSES))
#define KEY_PAGE_GENERATIONS 2u

enum key_purpose { KEY_END = 0, KEY_CALL = 1, KEY_MEASUREMENT = 2, KEY_JOINT = 3 };

struct key_ring {
    const uint8_t *page; /* NULL: there are no keys, and everybody is believed */
    uint32_t count;      /* of generations */
};

/* False where the page has no keys of this tube: it is empty, damaged, or another's. */
bool keys_open(struct key_ring *ring, const uint8_t *page, uint32_t size, uint8_t tube);
uint8_t keys_oldest(const struct key_ring *ring);
uint8_t keys_newest(const struct key_ring *ring);
/* The newest generation that both have, where the other's newest is known. */
uint8_t keys_common(const struct key_ring *ring, uint8_t others_newest);
/* A key of 16 bytes; NULL where there is none of this generation, or with this address. */
const uint8_t *keys_find(const struct key_ring *ring, uint8_t generation, enum key_purpose purpose, uint8_t other);

#endif
