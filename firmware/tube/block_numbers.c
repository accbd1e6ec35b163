/* The bytes of a parameter block as numbers of the step, see block_numbers.h. */
#include "block_numbers.h"

#include <stddef.h>
#include <string.h>

#include "borechain_orders.h"
#include "msgpack.h"

#define FORMAT 1u
#define TUBE_AT 6u
#define VERSION_AT 8u
#define HEAD 12u
#define SENSOR_NUMBERS 49u
#define TERM_NUMBERS 9u
#define BIAS_AT 36u /* of a sensor's numbers: matrix and its slopes before, bias and its slopes, the reference */
#define REFERENCE_AT 48u
#define ONE UINT64_C(0x3FF0000000000000)
#define ROOM_TEMPERATURE UINT64_C(0x4039000000000000) /* 25 C */
#define NEGATIVE_ZERO UINT64_C(0x8000000000000000)
#define EXPONENT 0x7FFu
#define FACTOR_Q 30
#define RATE_Q 46
#define FORCE_Q 26
#define WARMTH_Q 23
#define TERM_Q 7 /* a term more, for temperatures are counted in 128 C */
#define BEHIND_Q 20
#define GRAVITY 980665 /* 1e-5 m/s^2 */

static uint64_t number_at(const uint8_t *numbers, uint32_t which)
{
    uint64_t bits = 0u;
    uint32_t k;
    for (k = 0u; k < 8u; k++) {
        bits = bits << 8 | numbers[8u * which + 7u - k];
    }
    return bits;
}

static void put_number(uint8_t *numbers, uint32_t which, uint64_t bits)
{
    uint32_t k;
    for (k = 0u; k < 8u; k++) {
        numbers[8u * which + k] = (uint8_t)(bits >> (8u * k) & 0xFFu);
    }
}

void block_identity(uint8_t tube, uint8_t bytes[BLOCK_SIZE])
{
    static const uint8_t head[] = {'B', 'C', 'P', 'B', FORMAT, 0u};
    uint32_t sensor, k;
    memset(bytes, 0, BLOCK_SIZE);
    memcpy(bytes, head, sizeof head);
    bytes[TUBE_AT] = tube;
    for (sensor = 0u; sensor < 2u; sensor++) {
        for (k = 0u; k < 3u; k++) {
            put_number(&bytes[HEAD], SENSOR_NUMBERS * sensor + 4u * k, ONE);
        }
        put_number(&bytes[HEAD], SENSOR_NUMBERS * sensor + REFERENCE_AT, ROOM_TEMPERATURE);
    }
}

void block_hash(const uint8_t bytes[BLOCK_SIZE], uint8_t digest[SHA256_SIZE])
{
    struct sha256 hash;
    sha256_begin(&hash);
    sha256_add(&hash, bytes, BLOCK_SIZE);
    sha256_end(&hash, digest);
}

uint32_t block_tube(const uint8_t bytes[BLOCK_SIZE])
{
    return (uint32_t)bytes[TUBE_AT] | (uint32_t)bytes[TUBE_AT + 1u] << 8;
}

uint32_t block_version(const uint8_t bytes[BLOCK_SIZE])
{
    const uint8_t *const at = &bytes[VERSION_AT];
    return (uint32_t)at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

enum block_fault block_check(uint8_t bytes[BLOCK_SIZE])
{
    uint32_t k;
    if (memcmp(bytes, "BCPB", 4u) != 0 || bytes[4] != FORMAT || bytes[5] != 0u) {
        return BLOCK_OTHER_FORMAT;
    }
    for (k = 0u; k < 2u * SENSOR_NUMBERS; k++) {
        const uint64_t bits = number_at(&bytes[HEAD], k);
        if ((bits >> 52 & EXPONENT) == EXPONENT) {
            return BLOCK_NOT_FINITE;
        }
        if (bits == NEGATIVE_ZERO) {
            put_number(&bytes[HEAD], k, 0u);
        }
    }
    return BLOCK_WHOLE;
}

/* Forces in m/s^2 with further places, by gravity and to the nearest. */
static int64_t in_gravity(int64_t force)
{
    const int64_t counted = force / GRAVITY * 100000 + force % GRAVITY * 100000 / GRAVITY;
    return (counted + (INT64_C(1) << (BEHIND_Q - 1))) >> BEHIND_Q;
}

static void sensor_of(const uint8_t *numbers, bool is_force, struct borechain_sensor *sensor)
{
    uint32_t k;
    for (k = 0u; k < BIAS_AT; k++) {
        const int32_t q = FACTOR_Q + TERM_Q * (int32_t)(k / TERM_NUMBERS);
        sensor->matrix[k / 9u][k / 3u % 3u][k % 3u] = quantity_of_bits(number_at(numbers, k), q);
    }
    for (k = 0u; k < REFERENCE_AT - BIAS_AT; k++) {
        const uint64_t bits = number_at(numbers, BIAS_AT + k);
        const int32_t further = TERM_Q * (int32_t)(k / 3u);
        sensor->bias[k / 3u][k % 3u] = is_force ? in_gravity(quantity_of_bits(bits, FORCE_Q + BEHIND_Q + further))
                                                : quantity_of_bits(bits, RATE_Q + further);
    }
    sensor->reference = quantity_of_bits(number_at(numbers, REFERENCE_AT), WARMTH_Q);
}

void block_corrections(const uint8_t bytes[BLOCK_SIZE], struct borechain_parameters *corrections)
{
    memset(corrections, 0, sizeof *corrections);
    sensor_of(&bytes[HEAD], false, &corrections->gyroscope);
    sensor_of(&bytes[HEAD + 8u * SENSOR_NUMBERS], true, &corrections->accelerometer);
}

static bool is_same(const struct borechain_sensor *one, const struct borechain_sensor *other)
{
    return memcmp(one, other, offsetof(struct borechain_sensor, m)) == 0;
}

int64_t block_changes(const struct borechain_parameters *before, const struct borechain_parameters *after)
{
    return (is_same(&before->gyroscope, &after->gyroscope) ? 0 : BORECHAIN_RATES) |
           (is_same(&before->accelerometer, &after->accelerometer) ? 0 : BORECHAIN_FORCES);
}
