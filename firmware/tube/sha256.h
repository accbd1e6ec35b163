/* SHA-256 (FIPS 180-4) and HMAC (RFC 2104) with it, of what comes part by part. */
#ifndef BORECHAIN_SHA256_H
#define BORECHAIN_SHA256_H

#include <stdbool.h>
#include <stdint.h>

#define SHA256_SIZE 32u
#define SHA256_BLOCK 64u

struct sha256 {
    uint32_t state[8];
    uint32_t count; /* bytes taken so far */
    uint8_t block[SHA256_BLOCK];
};

struct hmac_sha256 {
    struct sha256 inner;
    uint8_t key[SHA256_BLOCK]; /* filled up with zeros */
};

void sha256_begin(struct sha256 *hash);
void sha256_add(struct sha256 *hash, const uint8_t *bytes, uint32_t length);
void sha256_end(struct sha256 *hash, uint8_t digest[SHA256_SIZE]);

void hmac_begin(struct hmac_sha256 *hmac, const uint8_t *key, uint32_t length);
void hmac_add(struct hmac_sha256 *hmac, const uint8_t *bytes, uint32_t length);
void hmac_end(struct hmac_sha256 *hmac, uint8_t tag[SHA256_SIZE]);
/* Whether two digests are the same, in a time that does not depend on them. */
bool digests_agree(const uint8_t one[SHA256_SIZE], const uint8_t other[SHA256_SIZE]);

#endif
