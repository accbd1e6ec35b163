/* Tags that tell who made some bytes, and the window that tells whether they came before.
 *
 * A tag is the first 64 bits of an AES-128 CMAC (RFC 4493, NIST SP 800-38B).
 */
#ifndef BORECHAIN_SEAL_H
#define BORECHAIN_SEAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define SEAL_KEY_SIZE 16u
#define SEAL_TAG_SIZE 8u
#define SEAL_BLOCK 16u
#define SEAL_WINDOW 64u

/* A key for tags, its schedule computed once. */
struct seal_key {
    uint8_t rounds[11][SEAL_BLOCK];
    uint8_t whole_last[SEAL_BLOCK]; /* K1: on the last block where that is whole */
    uint8_t cut_last[SEAL_BLOCK];   /* K2: where it is filled up */
};

/* Bytes of a message that come one part after the other; it begins as zeros. */
struct seal_run {
    uint8_t tag[SEAL_BLOCK];
    uint8_t last[SEAL_BLOCK]; /* a block is encrypted once it is known not to be the last */
    uint32_t held;            /* bytes of it */
};

/* Numbers that came: each is admitted once, and none that is 64 or more behind the largest; it begins as zeros. */
struct seal_window {
    uint64_t seen; /* bit k: the number k below the largest came */
    uint32_t largest;
};

void seal_set_key(struct seal_key *key, const uint8_t secret[SEAL_KEY_SIZE]);
void seal_tag(const struct seal_key *key, const uint8_t *message, size_t length, uint8_t tag[SEAL_BLOCK]);
void seal_add(const struct seal_key *key, struct seal_run *run, const uint8_t *part, size_t length);
/* The tag of all parts; the run is at its end. */
void seal_end(const struct seal_key *key, struct seal_run *run, uint8_t tag[SEAL_BLOCK]);
/* Whether the first SEAL_TAG_SIZE bytes of two tags are one, compared in constant time. */
bool seal_is_same(const uint8_t *tag, const uint8_t *other);
/* Whether the first SEAL_TAG_SIZE bytes are the message's, compared in constant time. */
bool seal_fits(const struct seal_key *key, const uint8_t *message, size_t length, const uint8_t tag[SEAL_TAG_SIZE]);
/* Whether a number comes for the first time; it is noted. */
bool seal_admit(struct seal_window *window, uint32_t number);

#endif
