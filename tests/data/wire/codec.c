/* Cyclic messages as signals on CAN. Written by `borechain firmware codec` from the table of the DBC file: do not edit.
 *
 * A member is a whole number of its signal's steps. The identifiers are those of sender 0: the address of another one
 * stands 13 bits up, the part of a message on classic CAN in the lowest five. The first byte of a frame is
 * the count: frames of the link so far, the same in all parts of one message.
 * An answer above 0 is the number of the first member whose value is outside the schema's range; what is refused
 * changes nothing but data that was to be packed.
 * What is called carries the digest of the table in its name: a header of another table does not link.
 */
#ifndef BORECHAIN_NATIVE_H
#define BORECHAIN_NATIVE_H

#include <stddef.h>
#include <stdint.h>

#define BORECHAIN_NATIVE_DIGEST "6eb91de5cf7e9ecc"
#define BORECHAIN_NATIVE_TAKEN 0
#define BORECHAIN_NATIVE_BAD_LENGTH (-1)
#define BORECHAIN_NATIVE_MOST_PARTS 10u /* of a message on classic CAN */
#define BORECHAIN_NATIVE_FD_PART 31u /* of a message that is whole in one frame */

#define borechain_native_pack_aiding borechain_native_pack_aiding_6eb91de5cf7e9ecc
#define borechain_native_unpack_aiding borechain_native_unpack_aiding_6eb91de5cf7e9ecc
#define borechain_native_pack_aiding_classic borechain_native_pack_aiding_classic_6eb91de5cf7e9ecc
#define borechain_native_unpack_aiding_classic borechain_native_unpack_aiding_classic_6eb91de5cf7e9ecc
#define borechain_native_pack_hello borechain_native_pack_hello_6eb91de5cf7e9ecc
#define borechain_native_unpack_hello borechain_native_unpack_hello_6eb91de5cf7e9ecc
#define borechain_native_pack_hello_classic borechain_native_pack_hello_classic_6eb91de5cf7e9ecc
#define borechain_native_unpack_hello_classic borechain_native_unpack_hello_classic_6eb91de5cf7e9ecc
#define borechain_native_pack_time_request borechain_native_pack_time_request_6eb91de5cf7e9ecc
#define borechain_native_unpack_time_request borechain_native_unpack_time_request_6eb91de5cf7e9ecc
#define borechain_native_pack_time_request_classic borechain_native_pack_time_request_classic_6eb91de5cf7e9ecc
#define borechain_native_unpack_time_request_classic borechain_native_unpack_time_request_classic_6eb91de5cf7e9ecc
#define borechain_native_pack_time_reply borechain_native_pack_time_reply_6eb91de5cf7e9ecc
#define borechain_native_unpack_time_reply borechain_native_unpack_time_reply_6eb91de5cf7e9ecc
#define borechain_native_pack_time_reply_classic borechain_native_pack_time_reply_classic_6eb91de5cf7e9ecc
#define borechain_native_unpack_time_reply_classic borechain_native_unpack_time_reply_classic_6eb91de5cf7e9ecc
#define borechain_native_pack_node_state borechain_native_pack_node_state_6eb91de5cf7e9ecc
#define borechain_native_unpack_node_state borechain_native_unpack_node_state_6eb91de5cf7e9ecc
#define borechain_native_pack_node_state_classic borechain_native_pack_node_state_classic_6eb91de5cf7e9ecc
#define borechain_native_unpack_node_state_classic borechain_native_unpack_node_state_classic_6eb91de5cf7e9ecc

struct borechain_native_aiding {
    /* 1: steps of 3.7450702829239286e-07 rad; the encoder's measurement, passed on unchanged */
    uint32_t yaw;
    /* 2: level: 0 for none, n for -215 + n steps of 0.5 dB(rad^2); random variance of the yaw */
    uint8_t yaw_var;
    /* 3: level: 0 for none, n for -215 + n steps of 0.5 dB(rad^2); constant errors of joints; never averages away */
    uint8_t systematic_var;
    /* 4: steps of 3.7450702829239286e-07 rad; make-up angles of the joints passed so far */
    int32_t offset;
    /* 5: steps of 1e-05 rad/s; rate about the tube axis */
    int32_t rate;
    /* 6: steps of 1e-05 s; rig time at which the yaw was valid */
    int64_t valid_at;
    /* 7: number of the measurement; the same number is the same one, repeated */
    uint64_t sequence;
    /* 8: of the sender; 0 is the encoder */
    int16_t hops;
    /* 9: steps of 1.0 N m; in the string: the drive's; once released what may be trapped, 1 sigma */
    uint32_t torque;
    /* 10: level: 0 for none, n for -215 + n steps of 0.5 dB(rad^2); of the twist in the tubes passed */
    uint8_t torsion_var;
    /* 11: the drive holds the string twisted */
    uint8_t under_torque;
    /* 12: of rig time: starts of the encoder so far, 0 unknown */
    uint16_t epoch;
};
#define BORECHAIN_NATIVE_AIDING_TYPE 1
#define BORECHAIN_NATIVE_AIDING_LENGTH 32 /* bytes on CAN FD */
#define BORECHAIN_NATIVE_AIDING_PARTS 5 /* frames on classic CAN */
#define BORECHAIN_NATIVE_AIDING_IDENTIFIER UINT32_C(0x04201FFF)
#define BORECHAIN_NATIVE_AIDING_IDENTIFIER_CLASSIC UINT32_C(0x04201FE0)
extern const uint8_t borechain_native_aiding_lengths[BORECHAIN_NATIVE_AIDING_PARTS];
int borechain_native_pack_aiding(
    const struct borechain_native_aiding *values,
    uint8_t count,
    uint8_t data[BORECHAIN_NATIVE_AIDING_LENGTH]);
int borechain_native_unpack_aiding(
    const uint8_t *data,
    size_t length,
    struct borechain_native_aiding *values);
int borechain_native_pack_aiding_classic(
    const struct borechain_native_aiding *values,
    uint8_t count,
    uint8_t data[BORECHAIN_NATIVE_AIDING_PARTS][8]);
int borechain_native_unpack_aiding_classic(
    uint8_t data[BORECHAIN_NATIVE_AIDING_PARTS][8],
    const uint8_t lengths[BORECHAIN_NATIVE_AIDING_PARTS],
    struct borechain_native_aiding *values);

struct borechain_native_hello {
    /* 1: whose it is: 0 encoder, 1..250 tube, 251 base station */
    uint8_t tube;
    /* 2: starts so far */
    uint32_t boot_count;
    /* 3: distance from the encoder in tubes, -1 unknown */
    int16_t hops;
    /* 4: execution state */
    uint8_t mode;
    /* 5: steps of 0.01 1; share of this side's frames received lately */
    uint8_t link_quality;
};
#define BORECHAIN_NATIVE_HELLO_TYPE 2
#define BORECHAIN_NATIVE_HELLO_LENGTH 12 /* bytes on CAN FD */
#define BORECHAIN_NATIVE_HELLO_PARTS 2 /* frames on classic CAN */
#define BORECHAIN_NATIVE_HELLO_IDENTIFIER UINT32_C(0x08401FFF)
#define BORECHAIN_NATIVE_HELLO_IDENTIFIER_CLASSIC UINT32_C(0x08401FE0)
extern const uint8_t borechain_native_hello_lengths[BORECHAIN_NATIVE_HELLO_PARTS];
int borechain_native_pack_hello(
    const struct borechain_native_hello *values,
    uint8_t count,
    uint8_t data[BORECHAIN_NATIVE_HELLO_LENGTH]);
int borechain_native_unpack_hello(
    const uint8_t *data,
    size_t length,
    struct borechain_native_hello *values);
int borechain_native_pack_hello_classic(
    const struct borechain_native_hello *values,
    uint8_t count,
    uint8_t data[BORECHAIN_NATIVE_HELLO_PARTS][8]);
int borechain_native_unpack_hello_classic(
    uint8_t data[BORECHAIN_NATIVE_HELLO_PARTS][8],
    const uint8_t lengths[BORECHAIN_NATIVE_HELLO_PARTS],
    struct borechain_native_hello *values);

struct borechain_native_time_request {
    /* 1: steps of 1e-05 s; clock of the asker */
    int64_t asked_at;
};
#define BORECHAIN_NATIVE_TIME_REQUEST_TYPE 3
#define BORECHAIN_NATIVE_TIME_REQUEST_LENGTH 7 /* bytes on CAN FD */
#define BORECHAIN_NATIVE_TIME_REQUEST_PARTS 1 /* frames on classic CAN */
#define BORECHAIN_NATIVE_TIME_REQUEST_IDENTIFIER UINT32_C(0x00601FFF)
#define BORECHAIN_NATIVE_TIME_REQUEST_IDENTIFIER_CLASSIC UINT32_C(0x00601FE0)
extern const uint8_t borechain_native_time_request_lengths[BORECHAIN_NATIVE_TIME_REQUEST_PARTS];
int borechain_native_pack_time_request(
    const struct borechain_native_time_request *values,
    uint8_t count,
    uint8_t data[BORECHAIN_NATIVE_TIME_REQUEST_LENGTH]);
int borechain_native_unpack_time_request(
    const uint8_t *data,
    size_t length,
    struct borechain_native_time_request *values);
int borechain_native_pack_time_request_classic(
    const struct borechain_native_time_request *values,
    uint8_t count,
    uint8_t data[BORECHAIN_NATIVE_TIME_REQUEST_PARTS][8]);
int borechain_native_unpack_time_request_classic(
    uint8_t data[BORECHAIN_NATIVE_TIME_REQUEST_PARTS][8],
    const uint8_t lengths[BORECHAIN_NATIVE_TIME_REQUEST_PARTS],
    struct borechain_native_time_request *values);

struct borechain_native_time_reply {
    /* 1: steps of 1e-05 s; clock of the asker, echoed */
    int64_t asked_at;
    /* 2: steps of 1e-05 s; clock of the replier when it received the request */
    int64_t received_at;
    /* 3: steps of 1e-05 s; clock of the replier when it replied */
    int64_t replied_at;
    /* 4: steps of 1e-05 s; rig time at replied_at */
    int64_t rig_at;
    /* 5: steps of 1e-09 1; rig seconds per second of the replier's clock */
    uint32_t rig_rate;
    /* 6: level: 0 for none, n for -331 + n steps of 0.5 dB(s^2); of rig_at */
    uint16_t clock_var;
    /* 7: of rig time: starts of the encoder so far, 0 unknown */
    uint16_t epoch;
};
#define BORECHAIN_NATIVE_TIME_REPLY_TYPE 4
#define BORECHAIN_NATIVE_TIME_REPLY_LENGTH 32 /* bytes on CAN FD */
#define BORECHAIN_NATIVE_TIME_REPLY_PARTS 5 /* frames on classic CAN */
#define BORECHAIN_NATIVE_TIME_REPLY_IDENTIFIER UINT32_C(0x00801FFF)
#define BORECHAIN_NATIVE_TIME_REPLY_IDENTIFIER_CLASSIC UINT32_C(0x00801FE0)
extern const uint8_t borechain_native_time_reply_lengths[BORECHAIN_NATIVE_TIME_REPLY_PARTS];
int borechain_native_pack_time_reply(
    const struct borechain_native_time_reply *values,
    uint8_t count,
    uint8_t data[BORECHAIN_NATIVE_TIME_REPLY_LENGTH]);
int borechain_native_unpack_time_reply(
    const uint8_t *data,
    size_t length,
    struct borechain_native_time_reply *values);
int borechain_native_pack_time_reply_classic(
    const struct borechain_native_time_reply *values,
    uint8_t count,
    uint8_t data[BORECHAIN_NATIVE_TIME_REPLY_PARTS][8]);
int borechain_native_unpack_time_reply_classic(
    uint8_t data[BORECHAIN_NATIVE_TIME_REPLY_PARTS][8],
    const uint8_t lengths[BORECHAIN_NATIVE_TIME_REPLY_PARTS],
    struct borechain_native_time_reply *values);

struct borechain_native_node_state {
    /* 1: whose it is: 0 encoder, 1..250 tube, 251 base station */
    uint8_t tube;
    /* 2: steps of 1e-05 s; rig time */
    int64_t at;
    /* 3: distance from the encoder in tubes, -1 unknown */
    int16_t hops;
    /* 4: execution state */
    uint8_t mode;
    /* 5: steps of 3.7450702829239286e-07 rad; yaw */
    uint32_t yaw;
    /* 6: level: 0 for none, n for -215 + n steps of 0.5 dB(rad^2); random variance of the yaw */
    uint8_t yaw_var;
    /* 7: level: 0 for none, n for -215 + n steps of 0.5 dB(rad^2); constant errors of joints; never averages away */
    uint8_t systematic_var;
    /* 8: steps of 1e-07 rad/s; estimated bias of the gyroscope */
    int32_t gyro_bias_x;
    /* 9: steps of 1e-07 rad/s; estimated bias of the gyroscope */
    int32_t gyro_bias_y;
    /* 10: steps of 1e-07 rad/s; estimated bias of the gyroscope */
    int32_t gyro_bias_z;
    /* 11: steps of 1e-06 1; estimated error of the gyroscope's z scale */
    int32_t scale_factor;
    /* 12: steps of 3.7450702829239286e-07 rad; of the last aiding */
    int32_t innovation;
    /* 13: level: 0 for none, n for -215 + n steps of 0.5 dB(rad^2); of the innovation */
    uint8_t innovation_var;
    /* 14: steps of 0.01 s, the highest is infinite; since the last aiding used, inf before the first */
    int32_t aiding_age;
    /* 15: level: 0 for none, n for -331 + n steps of 0.5 dB(s^2); variance of the node's rig time */
    uint16_t clock_var;
    /* 16: trust in the own yaw, bits of the table below */
    uint16_t flags;
    /* 17: since the start */
    uint32_t cycles;
    /* 18: cycles that ended too late */
    uint8_t overruns;
    /* 19: of the parameter block in use, 0 is the identity */
    uint16_t parameters_version;
    /* 20: four bytes, the first the highest; first bytes of the block's SHA-256 */
    uint32_t parameters_hash_1;
    /* 21: four bytes, the first the highest; first bytes of the block's SHA-256 */
    uint32_t parameters_hash_2;
    /* 22: steps of 1e-06 rad; pitch, roll and standard error of the first IMU, 0 if never aligned */
    int32_t alignment_x;
    /* 23: steps of 1e-06 rad; pitch, roll and standard error of the first IMU, 0 if never aligned */
    int32_t alignment_y;
    /* 24: steps of 1e-06 rad; pitch, roll and standard error of the first IMU, 0 if never aligned */
    int32_t alignment_z;
    /* 25: of rig time: starts of the encoder so far, 0 unknown */
    uint16_t epoch;
    /* 26: newest number given to what is kept, 0 if none */
    uint32_t numbered;
};
#define BORECHAIN_NATIVE_NODE_STATE_TYPE 5
#define BORECHAIN_NATIVE_NODE_STATE_LENGTH 64 /* bytes on CAN FD */
#define BORECHAIN_NATIVE_NODE_STATE_PARTS 10 /* frames on classic CAN */
#define BORECHAIN_NATIVE_NODE_STATE_INFINITE_AIDING_AGE INT32_C(16776215)
#define BORECHAIN_NATIVE_NODE_STATE_IDENTIFIER UINT32_C(0x14A01FFF)
#define BORECHAIN_NATIVE_NODE_STATE_IDENTIFIER_CLASSIC UINT32_C(0x14A01FE0)
extern const uint8_t borechain_native_node_state_lengths[BORECHAIN_NATIVE_NODE_STATE_PARTS];
int borechain_native_pack_node_state(
    const struct borechain_native_node_state *values,
    uint8_t count,
    uint8_t data[BORECHAIN_NATIVE_NODE_STATE_LENGTH]);
int borechain_native_unpack_node_state(
    const uint8_t *data,
    size_t length,
    struct borechain_native_node_state *values);
int borechain_native_pack_node_state_classic(
    const struct borechain_native_node_state *values,
    uint8_t count,
    uint8_t data[BORECHAIN_NATIVE_NODE_STATE_PARTS][8]);
int borechain_native_unpack_node_state_classic(
    uint8_t data[BORECHAIN_NATIVE_NODE_STATE_PARTS][8],
    const uint8_t lengths[BORECHAIN_NATIVE_NODE_STATE_PARTS],
    struct borechain_native_node_state *values);

#endif
/* Cyclic messages as signals on CAN. Written by `borechain firmware codec`: do not edit. */
#include "borechain_native.h"

#include <string.h>

/* Bits of data, the lowest of the first byte first. */
static uint32_t get_word(const uint8_t *data, unsigned start, unsigned bits)
{
    uint32_t word = 0u;
    unsigned taken = 0u;
    while (taken < bits) {
        const unsigned offset = (start + taken) & 7u;
        unsigned part = 8u - offset;
        if (part > bits - taken) {
            part = bits - taken;
        }
        word |= (((uint32_t)data[(start + taken) >> 3] >> offset) & ((1u << part) - 1u)) << taken;
        taken += part;
    }
    return word;
}

static uint64_t get_long(const uint8_t *data, unsigned start, unsigned bits)
{
    return ((uint64_t)get_word(data, start + 32u, bits - 32u) << 32) | get_word(data, start, 32u);
}

/* Data begins as zeros. */
static void put_word(uint8_t *data, unsigned start, unsigned bits, uint32_t word)
{
    unsigned given = 0u;
    while (given < bits) {
        const unsigned offset = (start + given) & 7u;
        unsigned part = 8u - offset;
        uint8_t *byte = &data[(start + given) >> 3];
        if (part > bits - given) {
            part = bits - given;
        }
        *byte = (uint8_t)(*byte | (((word >> given) & ((1u << part) - 1u)) << offset));
        given += part;
    }
}

static void put_long(uint8_t *data, unsigned start, unsigned bits, uint64_t value)
{
    put_word(data, start, 32u, (uint32_t)(value & UINT32_MAX));
    put_word(data, start + 32u, bits - 32u, (uint32_t)(value >> 32));
}

const uint8_t borechain_native_aiding_lengths[BORECHAIN_NATIVE_AIDING_PARTS] = {8u, 7u, 7u, 8u, 8u};

static int check_aiding(const struct borechain_native_aiding *values)
{
    if (values->yaw > UINT32_C(16777215)) {
        return 1;
    }
    if (values->offset < INT32_C(-16777216) || values->offset > INT32_C(16777216)) {
        return 4;
    }
    if (values->rate < INT32_C(-10000000) || values->rate > INT32_C(10000000)) {
        return 5;
    }
    if (values->valid_at < INT64_C(-140737488355328) || values->valid_at > INT64_C(140737488355327)) {
        return 6;
    }
    if (values->sequence > UINT64_C(9007199254740992)) {
        return 7;
    }
    if (values->hops < INT32_C(-1) || values->hops > INT32_C(251)) {
        return 8;
    }
    if (values->torque > UINT32_C(1000000)) {
        return 9;
    }
    if (values->under_torque > UINT32_C(1)) {
        return 11;
    }
    return BORECHAIN_NATIVE_TAKEN;
}

int borechain_native_pack_aiding(
    const struct borechain_native_aiding *values,
    uint8_t count,
    uint8_t data[BORECHAIN_NATIVE_AIDING_LENGTH])
{
    const int refused = check_aiding(values);
    if (refused != 0) {
        return refused;
    }
    memset(data, 0, BORECHAIN_NATIVE_AIDING_LENGTH);
    data[0] = count;
    put_word(data, 8u, 24u, values->yaw);
    put_word(data, 32u, 8u, values->yaw_var);
    put_word(data, 40u, 8u, values->systematic_var);
    put_word(data, 48u, 26u, (uint32_t)(values->offset - INT32_C(-33554432)));
    put_word(data, 74u, 25u, (uint32_t)(values->rate - INT32_C(-16777216)));
    put_long(data, 99u, 48u, (uint64_t)(values->valid_at - INT64_C(-140737488355328)));
    put_long(data, 147u, 54u, values->sequence);
    put_word(data, 201u, 8u, (uint32_t)(values->hops - INT32_C(-1)));
    put_word(data, 209u, 20u, values->torque);
    put_word(data, 229u, 8u, values->torsion_var);
    put_word(data, 237u, 1u, values->under_torque);
    put_word(data, 238u, 16u, values->epoch);
    return BORECHAIN_NATIVE_TAKEN;
}

int borechain_native_unpack_aiding(
    const uint8_t *data,
    size_t length,
    struct borechain_native_aiding *values)
{
    struct borechain_native_aiding found;
    int refused;
    if (length != BORECHAIN_NATIVE_AIDING_LENGTH) {
        return BORECHAIN_NATIVE_BAD_LENGTH;
    }
    found.yaw = get_word(data, 8u, 24u);
    found.yaw_var = (uint8_t)get_word(data, 32u, 8u);
    found.systematic_var = (uint8_t)get_word(data, 40u, 8u);
    found.offset = (int32_t)((int32_t)get_word(data, 48u, 26u) + INT32_C(-33554432));
    found.rate = (int32_t)((int32_t)get_word(data, 74u, 25u) + INT32_C(-16777216));
    found.valid_at = (int64_t)((int64_t)get_long(data, 99u, 48u) + INT64_C(-140737488355328));
    found.sequence = get_long(data, 147u, 54u);
    found.hops = (int16_t)((int32_t)get_word(data, 201u, 8u) + INT32_C(-1));
    found.torque = get_word(data, 209u, 20u);
    found.torsion_var = (uint8_t)get_word(data, 229u, 8u);
    found.under_torque = (uint8_t)get_word(data, 237u, 1u);
    found.epoch = (uint16_t)get_word(data, 238u, 16u);
    refused = check_aiding(&found);
    if (refused == 0) {
        *values = found;
    }
    return refused;
}

int borechain_native_pack_aiding_classic(
    const struct borechain_native_aiding *values,
    uint8_t count,
    uint8_t data[BORECHAIN_NATIVE_AIDING_PARTS][8])
{
    unsigned part;
    const int refused = check_aiding(values);
    if (refused != 0) {
        return refused;
    }
    memset(data, 0, 8u * BORECHAIN_NATIVE_AIDING_PARTS);
    for (part = 0u; part < BORECHAIN_NATIVE_AIDING_PARTS; part++) {
        data[part][0] = count;
    }
    put_word(data[0u], 8u, 24u, values->yaw);
    put_word(data[0u], 32u, 8u, values->yaw_var);
    put_word(data[4u], 8u, 8u, values->systematic_var);
    put_word(data[4u], 16u, 26u, (uint32_t)(values->offset - INT32_C(-33554432)));
    put_word(data[1u], 8u, 25u, (uint32_t)(values->rate - INT32_C(-16777216)));
    put_long(data[2u], 8u, 48u, (uint64_t)(values->valid_at - INT64_C(-140737488355328)));
    put_long(data[3u], 8u, 54u, values->sequence);
    put_word(data[4u], 42u, 8u, (uint32_t)(values->hops - INT32_C(-1)));
    put_word(data[0u], 40u, 20u, values->torque);
    put_word(data[4u], 50u, 8u, values->torsion_var);
    put_word(data[0u], 60u, 1u, values->under_torque);
    put_word(data[1u], 33u, 16u, values->epoch);
    return BORECHAIN_NATIVE_TAKEN;
}

int borechain_native_unpack_aiding_classic(
    uint8_t data[BORECHAIN_NATIVE_AIDING_PARTS][8],
    const uint8_t lengths[BORECHAIN_NATIVE_AIDING_PARTS],
    struct borechain_native_aiding *values)
{
    struct borechain_native_aiding found;
    int refused;
    unsigned part;
    for (part = 0u; part < BORECHAIN_NATIVE_AIDING_PARTS; part++) {
        if (lengths[part] != borechain_native_aiding_lengths[part]) {
            return BORECHAIN_NATIVE_BAD_LENGTH;
        }
    }
    found.yaw = get_word(data[0u], 8u, 24u);
    found.yaw_var = (uint8_t)get_word(data[0u], 32u, 8u);
    found.systematic_var = (uint8_t)get_word(data[4u], 8u, 8u);
    found.offset = (int32_t)((int32_t)get_word(data[4u], 16u, 26u) + INT32_C(-33554432));
    found.rate = (int32_t)((int32_t)get_word(data[1u], 8u, 25u) + INT32_C(-16777216));
    found.valid_at = (int64_t)((int64_t)get_long(data[2u], 8u, 48u) + INT64_C(-140737488355328));
    found.sequence = get_long(data[3u], 8u, 54u);
    found.hops = (int16_t)((int32_t)get_word(data[4u], 42u, 8u) + INT32_C(-1));
    found.torque = get_word(data[0u], 40u, 20u);
    found.torsion_var = (uint8_t)get_word(data[4u], 50u, 8u);
    found.under_torque = (uint8_t)get_word(data[0u], 60u, 1u);
    found.epoch = (uint16_t)get_word(data[1u], 33u, 16u);
    refused = check_aiding(&found);
    if (refused == 0) {
        *values = found;
    }
    return refused;
}

const uint8_t borechain_native_hello_lengths[BORECHAIN_NATIVE_HELLO_PARTS] = {8u, 2u};

static int check_hello(const struct borechain_native_hello *values)
{
    if (values->tube > UINT32_C(251)) {
        return 1;
    }
    if (values->hops < INT32_C(-1) || values->hops > INT32_C(251)) {
        return 3;
    }
    if (values->mode > UINT32_C(7)) {
        return 4;
    }
    if (values->link_quality > UINT32_C(100)) {
        return 5;
    }
    return BORECHAIN_NATIVE_TAKEN;
}

int borechain_native_pack_hello(
    const struct borechain_native_hello *values,
    uint8_t count,
    uint8_t data[BORECHAIN_NATIVE_HELLO_LENGTH])
{
    const int refused = check_hello(values);
    if (refused != 0) {
        return refused;
    }
    memset(data, 0, BORECHAIN_NATIVE_HELLO_LENGTH);
    data[0] = count;
    put_word(data, 8u, 8u, values->tube);
    put_word(data, 16u, 32u, values->boot_count);
    put_word(data, 48u, 8u, (uint32_t)(values->hops - INT32_C(-1)));
    put_word(data, 56u, 3u, values->mode);
    put_word(data, 59u, 7u, values->link_quality);
    return BORECHAIN_NATIVE_TAKEN;
}

int borechain_native_unpack_hello(
    const uint8_t *data,
    size_t length,
    struct borechain_native_hello *values)
{
    struct borechain_native_hello found;
    int refused;
    if (length != BORECHAIN_NATIVE_HELLO_LENGTH) {
        return BORECHAIN_NATIVE_BAD_LENGTH;
    }
    found.tube = (uint8_t)get_word(data, 8u, 8u);
    found.boot_count = get_word(data, 16u, 32u);
    found.hops = (int16_t)((int32_t)get_word(data, 48u, 8u) + INT32_C(-1));
    found.mode = (uint8_t)get_word(data, 56u, 3u);
    found.link_quality = (uint8_t)get_word(data, 59u, 7u);
    refused = check_hello(&found);
    if (refused == 0) {
        *values = found;
    }
    return refused;
}

int borechain_native_pack_hello_classic(
    const struct borechain_native_hello *values,
    uint8_t count,
    uint8_t data[BORECHAIN_NATIVE_HELLO_PARTS][8])
{
    unsigned part;
    const int refused = check_hello(values);
    if (refused != 0) {
        return refused;
    }
    memset(data, 0, 8u * BORECHAIN_NATIVE_HELLO_PARTS);
    for (part = 0u; part < BORECHAIN_NATIVE_HELLO_PARTS; part++) {
        data[part][0] = count;
    }
    put_word(data[0u], 8u, 8u, values->tube);
    put_word(data[0u], 16u, 32u, values->boot_count);
    put_word(data[0u], 48u, 8u, (uint32_t)(values->hops - INT32_C(-1)));
    put_word(data[0u], 56u, 3u, values->mode);
    put_word(data[1u], 8u, 7u, values->link_quality);
    return BORECHAIN_NATIVE_TAKEN;
}

int borechain_native_unpack_hello_classic(
    uint8_t data[BORECHAIN_NATIVE_HELLO_PARTS][8],
    const uint8_t lengths[BORECHAIN_NATIVE_HELLO_PARTS],
    struct borechain_native_hello *values)
{
    struct borechain_native_hello found;
    int refused;
    unsigned part;
    for (part = 0u; part < BORECHAIN_NATIVE_HELLO_PARTS; part++) {
        if (lengths[part] != borechain_native_hello_lengths[part]) {
            return BORECHAIN_NATIVE_BAD_LENGTH;
        }
    }
    found.tube = (uint8_t)get_word(data[0u], 8u, 8u);
    found.boot_count = get_word(data[0u], 16u, 32u);
    found.hops = (int16_t)((int32_t)get_word(data[0u], 48u, 8u) + INT32_C(-1));
    found.mode = (uint8_t)get_word(data[0u], 56u, 3u);
    found.link_quality = (uint8_t)get_word(data[1u], 8u, 7u);
    refused = check_hello(&found);
    if (refused == 0) {
        *values = found;
    }
    return refused;
}

const uint8_t borechain_native_time_request_lengths[BORECHAIN_NATIVE_TIME_REQUEST_PARTS] = {7u};

static int check_time_request(const struct borechain_native_time_request *values)
{
    if (values->asked_at < INT64_C(-140737488355328) || values->asked_at > INT64_C(140737488355327)) {
        return 1;
    }
    return BORECHAIN_NATIVE_TAKEN;
}

int borechain_native_pack_time_request(
    const struct borechain_native_time_request *values,
    uint8_t count,
    uint8_t data[BORECHAIN_NATIVE_TIME_REQUEST_LENGTH])
{
    const int refused = check_time_request(values);
    if (refused != 0) {
        return refused;
    }
    memset(data, 0, BORECHAIN_NATIVE_TIME_REQUEST_LENGTH);
    data[0] = count;
    put_long(data, 8u, 48u, (uint64_t)(values->asked_at - INT64_C(-140737488355328)));
    return BORECHAIN_NATIVE_TAKEN;
}

int borechain_native_unpack_time_request(
    const uint8_t *data,
    size_t length,
    struct borechain_native_time_request *values)
{
    struct borechain_native_time_request found;
    int refused;
    if (length != BORECHAIN_NATIVE_TIME_REQUEST_LENGTH) {
        return BORECHAIN_NATIVE_BAD_LENGTH;
    }
    found.asked_at = (int64_t)((int64_t)get_long(data, 8u, 48u) + INT64_C(-140737488355328));
    refused = check_time_request(&found);
    if (refused == 0) {
        *values = found;
    }
    return refused;
}

int borechain_native_pack_time_request_classic(
    const struct borechain_native_time_request *values,
    uint8_t count,
    uint8_t data[BORECHAIN_NATIVE_TIME_REQUEST_PARTS][8])
{
    unsigned part;
    const int refused = check_time_request(values);
    if (refused != 0) {
        return refused;
    }
    memset(data, 0, 8u * BORECHAIN_NATIVE_TIME_REQUEST_PARTS);
    for (part = 0u; part < BORECHAIN_NATIVE_TIME_REQUEST_PARTS; part++) {
        data[part][0] = count;
    }
    put_long(data[0u], 8u, 48u, (uint64_t)(values->asked_at - INT64_C(-140737488355328)));
    return BORECHAIN_NATIVE_TAKEN;
}

int borechain_native_unpack_time_request_classic(
    uint8_t data[BORECHAIN_NATIVE_TIME_REQUEST_PARTS][8],
    const uint8_t lengths[BORECHAIN_NATIVE_TIME_REQUEST_PARTS],
    struct borechain_native_time_request *values)
{
    struct borechain_native_time_request found;
    int refused;
    unsigned part;
    for (part = 0u; part < BORECHAIN_NATIVE_TIME_REQUEST_PARTS; part++) {
        if (lengths[part] != borechain_native_time_request_lengths[part]) {
            return BORECHAIN_NATIVE_BAD_LENGTH;
        }
    }
    found.asked_at = (int64_t)((int64_t)get_long(data[0u], 8u, 48u) + INT64_C(-140737488355328));
    refused = check_time_request(&found);
    if (refused == 0) {
        *values = found;
    }
    return refused;
}

const uint8_t borechain_native_time_reply_lengths[BORECHAIN_NATIVE_TIME_REPLY_PARTS] = {7u, 7u, 7u, 7u, 8u};

static int check_time_reply(const struct borechain_native_time_reply *values)
{
    if (values->asked_at < INT64_C(-140737488355328) || values->asked_at > INT64_C(140737488355327)) {
        return 1;
    }
    if (values->received_at < INT64_C(-140737488355328) || values->received_at > INT64_C(140737488355327)) {
        return 2;
    }
    if (values->replied_at < INT64_C(-140737488355328) || values->replied_at > INT64_C(140737488355327)) {
        return 3;
    }
    if (values->rig_at < INT64_C(-140737488355328) || values->rig_at > INT64_C(140737488355327)) {
        return 4;
    }
    if (values->rig_rate < UINT32_C(500000000) || values->rig_rate > UINT32_C(2000000000)) {
        return 5;
    }
    if (values->clock_var > UINT32_C(511)) {
        return 6;
    }
    return BORECHAIN_NATIVE_TAKEN;
}

int borechain_native_pack_time_reply(
    const struct borechain_native_time_reply *values,
    uint8_t count,
    uint8_t data[BORECHAIN_NATIVE_TIME_REPLY_LENGTH])
{
    const int refused = check_time_reply(values);
    if (refused != 0) {
        return refused;
    }
    memset(data, 0, BORECHAIN_NATIVE_TIME_REPLY_LENGTH);
    data[0] = count;
    put_long(data, 8u, 48u, (uint64_t)(values->asked_at - INT64_C(-140737488355328)));
    put_long(data, 56u, 48u, (uint64_t)(values->received_at - INT64_C(-140737488355328)));
    put_long(data, 104u, 48u, (uint64_t)(values->replied_at - INT64_C(-140737488355328)));
    put_long(data, 152u, 48u, (uint64_t)(values->rig_at - INT64_C(-140737488355328)));
    put_word(data, 200u, 31u, (uint32_t)(values->rig_rate - UINT32_C(500000000)));
    put_word(data, 231u, 9u, values->clock_var);
    put_word(data, 240u, 16u, values->epoch);
    return BORECHAIN_NATIVE_TAKEN;
}

int borechain_native_unpack_time_reply(
    const uint8_t *data,
    size_t length,
    struct borechain_native_time_reply *values)
{
    struct borechain_native_time_reply found;
    int refused;
    if (length != BORECHAIN_NATIVE_TIME_REPLY_LENGTH) {
        return BORECHAIN_NATIVE_BAD_LENGTH;
    }
    found.asked_at = (int64_t)((int64_t)get_long(data, 8u, 48u) + INT64_C(-140737488355328));
    found.received_at = (int64_t)((int64_t)get_long(data, 56u, 48u) + INT64_C(-140737488355328));
    found.replied_at = (int64_t)((int64_t)get_long(data, 104u, 48u) + INT64_C(-140737488355328));
    found.rig_at = (int64_t)((int64_t)get_long(data, 152u, 48u) + INT64_C(-140737488355328));
    found.rig_rate = (get_word(data, 200u, 31u) + UINT32_C(500000000));
    found.clock_var = (uint16_t)get_word(data, 231u, 9u);
    found.epoch = (uint16_t)get_word(data, 240u, 16u);
    refused = check_time_reply(&found);
    if (refused == 0) {
        *values = found;
    }
    return refused;
}

int borechain_native_pack_time_reply_classic(
    const struct borechain_native_time_reply *values,
    uint8_t count,
    uint8_t data[BORECHAIN_NATIVE_TIME_REPLY_PARTS][8])
{
    unsigned part;
    const int refused = check_time_reply(values);
    if (refused != 0) {
        return refused;
    }
    memset(data, 0, 8u * BORECHAIN_NATIVE_TIME_REPLY_PARTS);
    for (part = 0u; part < BORECHAIN_NATIVE_TIME_REPLY_PARTS; part++) {
        data[part][0] = count;
    }
    put_long(data[0u], 8u, 48u, (uint64_t)(values->asked_at - INT64_C(-140737488355328)));
    put_long(data[1u], 8u, 48u, (uint64_t)(values->received_at - INT64_C(-140737488355328)));
    put_long(data[2u], 8u, 48u, (uint64_t)(values->replied_at - INT64_C(-140737488355328)));
    put_long(data[3u], 8u, 48u, (uint64_t)(values->rig_at - INT64_C(-140737488355328)));
    put_word(data[4u], 8u, 31u, (uint32_t)(values->rig_rate - UINT32_C(500000000)));
    put_word(data[4u], 39u, 9u, values->clock_var);
    put_word(data[4u], 48u, 16u, values->epoch);
    return BORECHAIN_NATIVE_TAKEN;
}

int borechain_native_unpack_time_reply_classic(
    uint8_t data[BORECHAIN_NATIVE_TIME_REPLY_PARTS][8],
    const uint8_t lengths[BORECHAIN_NATIVE_TIME_REPLY_PARTS],
    struct borechain_native_time_reply *values)
{
    struct borechain_native_time_reply found;
    int refused;
    unsigned part;
    for (part = 0u; part < BORECHAIN_NATIVE_TIME_REPLY_PARTS; part++) {
        if (lengths[part] != borechain_native_time_reply_lengths[part]) {
            return BORECHAIN_NATIVE_BAD_LENGTH;
        }
    }
    found.asked_at = (int64_t)((int64_t)get_long(data[0u], 8u, 48u) + INT64_C(-140737488355328));
    found.received_at = (int64_t)((int64_t)get_long(data[1u], 8u, 48u) + INT64_C(-140737488355328));
    found.replied_at = (int64_t)((int64_t)get_long(data[2u], 8u, 48u) + INT64_C(-140737488355328));
    found.rig_at = (int64_t)((int64_t)get_long(data[3u], 8u, 48u) + INT64_C(-140737488355328));
    found.rig_rate = (get_word(data[4u], 8u, 31u) + UINT32_C(500000000));
    found.clock_var = (uint16_t)get_word(data[4u], 39u, 9u);
    found.epoch = (uint16_t)get_word(data[4u], 48u, 16u);
    refused = check_time_reply(&found);
    if (refused == 0) {
        *values = found;
    }
    return refused;
}

const uint8_t borechain_native_node_state_lengths[BORECHAIN_NATIVE_NODE_STATE_PARTS] = {8u, 8u, 8u, 8u, 8u, 7u, 7u, 8u, 7u, 7u};

static int check_node_state(const struct borechain_native_node_state *values)
{
    if (values->tube > UINT32_C(251)) {
        return 1;
    }
    if (values->at < INT64_C(-140737488355328) || values->at > INT64_C(140737488355327)) {
        return 2;
    }
    if (values->hops < INT32_C(-1) || values->hops > INT32_C(251)) {
        return 3;
    }
    if (values->mode > UINT32_C(7)) {
        return 4;
    }
    if (values->yaw > UINT32_C(16777215)) {
        return 5;
    }
    if (values->gyro_bias_x < INT32_C(-2097152) || values->gyro_bias_x > INT32_C(2097151)) {
        return 8;
    }
    if (values->gyro_bias_y < INT32_C(-2097152) || values->gyro_bias_y > INT32_C(2097151)) {
        return 9;
    }
    if (values->gyro_bias_z < INT32_C(-2097152) || values->gyro_bias_z > INT32_C(2097151)) {
        return 10;
    }
    if (values->scale_factor < INT32_C(-1000000) || values->scale_factor > INT32_C(1000000)) {
        return 11;
    }
    if (values->innovation < INT32_C(-16777216) || values->innovation > INT32_C(16777216)) {
        return 12;
    }
    if (values->aiding_age < INT32_C(-1000) || values->aiding_age > INT32_C(16776215)) {
        return 14;
    }
    if (values->clock_var > UINT32_C(511)) {
        return 15;
    }
    if (values->cycles > UINT32_C(4194303)) {
        return 17;
    }
    if (values->parameters_version > UINT32_C(4095)) {
        return 19;
    }
    if (values->alignment_x < INT32_C(-6283185) || values->alignment_x > INT32_C(6283185)) {
        return 22;
    }
    if (values->alignment_y < INT32_C(-6283185) || values->alignment_y > INT32_C(6283185)) {
        return 23;
    }
    if (values->alignment_z < INT32_C(-6283185) || values->alignment_z > INT32_C(6283185)) {
        return 24;
    }
    if (values->numbered > UINT32_C(268435455)) {
        return 26;
    }
    return BORECHAIN_NATIVE_TAKEN;
}

int borechain_native_pack_node_state(
    const struct borechain_native_node_state *values,
    uint8_t count,
    uint8_t data[BORECHAIN_NATIVE_NODE_STATE_LENGTH])
{
    const int refused = check_node_state(values);
    if (refused != 0) {
        return refused;
    }
    memset(data, 0, BORECHAIN_NATIVE_NODE_STATE_LENGTH);
    data[0] = count;
    put_word(data, 8u, 8u, values->tube);
    put_long(data, 16u, 48u, (uint64_t)(values->at - INT64_C(-140737488355328)));
    put_word(data, 64u, 8u, (uint32_t)(values->hops - INT32_C(-1)));
    put_word(data, 72u, 3u, values->mode);
    put_word(data, 75u, 24u, values->yaw);
    put_word(data, 99u, 8u, values->yaw_var);
    put_word(data, 107u, 8u, values->systematic_var);
    put_word(data, 115u, 22u, (uint32_t)(values->gyro_bias_x - INT32_C(-2097152)));
    put_word(data, 137u, 22u, (uint32_t)(values->gyro_bias_y - INT32_C(-2097152)));
    put_word(data, 159u, 22u, (uint32_t)(values->gyro_bias_z - INT32_C(-2097152)));
    put_word(data, 181u, 21u, (uint32_t)(values->scale_factor - INT32_C(-1048576)));
    put_word(data, 202u, 26u, (uint32_t)(values->innovation - INT32_C(-33554432)));
    put_word(data, 228u, 8u, values->innovation_var);
    put_word(data, 236u, 24u, (uint32_t)(values->aiding_age - INT32_C(-1000)));
    put_word(data, 260u, 9u, values->clock_var);
    put_word(data, 269u, 16u, values->flags);
    put_word(data, 285u, 22u, values->cycles);
    put_word(data, 307u, 8u, values->overruns);
    put_word(data, 315u, 12u, values->parameters_version);
    put_word(data, 327u, 32u, values->parameters_hash_1);
    put_word(data, 359u, 32u, values->parameters_hash_2);
    put_word(data, 391u, 24u, (uint32_t)(values->alignment_x - INT32_C(-8388608)));
    put_word(data, 415u, 24u, (uint32_t)(values->alignment_y - INT32_C(-8388608)));
    put_word(data, 439u, 24u, (uint32_t)(values->alignment_z - INT32_C(-8388608)));
    put_word(data, 463u, 16u, values->epoch);
    put_word(data, 479u, 28u, values->numbered);
    return BORECHAIN_NATIVE_TAKEN;
}

int borechain_native_unpack_node_state(
    const uint8_t *data,
    size_t length,
    struct borechain_native_node_state *values)
{
    struct borechain_native_node_state found;
    int refused;
    if (length != BORECHAIN_NATIVE_NODE_STATE_LENGTH) {
        return BORECHAIN_NATIVE_BAD_LENGTH;
    }
    found.tube = (uint8_t)get_word(data, 8u, 8u);
    found.at = (int64_t)((int64_t)get_long(data, 16u, 48u) + INT64_C(-140737488355328));
    found.hops = (int16_t)((int32_t)get_word(data, 64u, 8u) + INT32_C(-1));
    found.mode = (uint8_t)get_word(data, 72u, 3u);
    found.yaw = get_word(data, 75u, 24u);
    found.yaw_var = (uint8_t)get_word(data, 99u, 8u);
    found.systematic_var = (uint8_t)get_word(data, 107u, 8u);
    found.gyro_bias_x = (int32_t)((int32_t)get_word(data, 115u, 22u) + INT32_C(-2097152));
    found.gyro_bias_y = (int32_t)((int32_t)get_word(data, 137u, 22u) + INT32_C(-2097152));
    found.gyro_bias_z = (int32_t)((int32_t)get_word(data, 159u, 22u) + INT32_C(-2097152));
    found.scale_factor = (int32_t)((int32_t)get_word(data, 181u, 21u) + INT32_C(-1048576));
    found.innovation = (int32_t)((int32_t)get_word(data, 202u, 26u) + INT32_C(-33554432));
    found.innovation_var = (uint8_t)get_word(data, 228u, 8u);
    found.aiding_age = (int32_t)((int32_t)get_word(data, 236u, 24u) + INT32_C(-1000));
    found.clock_var = (uint16_t)get_word(data, 260u, 9u);
    found.flags = (uint16_t)get_word(data, 269u, 16u);
    found.cycles = get_word(data, 285u, 22u);
    found.overruns = (uint8_t)get_word(data, 307u, 8u);
    found.parameters_version = (uint16_t)get_word(data, 315u, 12u);
    found.parameters_hash_1 = get_word(data, 327u, 32u);
    found.parameters_hash_2 = get_word(data, 359u, 32u);
    found.alignment_x = (int32_t)((int32_t)get_word(data, 391u, 24u) + INT32_C(-8388608));
    found.alignment_y = (int32_t)((int32_t)get_word(data, 415u, 24u) + INT32_C(-8388608));
    found.alignment_z = (int32_t)((int32_t)get_word(data, 439u, 24u) + INT32_C(-8388608));
    found.epoch = (uint16_t)get_word(data, 463u, 16u);
    found.numbered = get_word(data, 479u, 28u);
    refused = check_node_state(&found);
    if (refused == 0) {
        *values = found;
    }
    return refused;
}

int borechain_native_pack_node_state_classic(
    const struct borechain_native_node_state *values,
    uint8_t count,
    uint8_t data[BORECHAIN_NATIVE_NODE_STATE_PARTS][8])
{
    unsigned part;
    const int refused = check_node_state(values);
    if (refused != 0) {
        return refused;
    }
    memset(data, 0, 8u * BORECHAIN_NATIVE_NODE_STATE_PARTS);
    for (part = 0u; part < BORECHAIN_NATIVE_NODE_STATE_PARTS; part++) {
        data[part][0] = count;
    }
    put_word(data[0u], 8u, 8u, values->tube);
    put_long(data[0u], 16u, 48u, (uint64_t)(values->at - INT64_C(-140737488355328)));
    put_word(data[1u], 8u, 8u, (uint32_t)(values->hops - INT32_C(-1)));
    put_word(data[1u], 16u, 3u, values->mode);
    put_word(data[1u], 19u, 24u, values->yaw);
    put_word(data[1u], 43u, 8u, values->yaw_var);
    put_word(data[1u], 51u, 8u, values->systematic_var);
    put_word(data[2u], 8u, 22u, (uint32_t)(values->gyro_bias_x - INT32_C(-2097152)));
    put_word(data[2u], 30u, 22u, (uint32_t)(values->gyro_bias_y - INT32_C(-2097152)));
    put_word(data[3u], 8u, 22u, (uint32_t)(values->gyro_bias_z - INT32_C(-2097152)));
    put_word(data[3u], 30u, 21u, (uint32_t)(values->scale_factor - INT32_C(-1048576)));
    put_word(data[4u], 8u, 26u, (uint32_t)(values->innovation - INT32_C(-33554432)));
    put_word(data[2u], 52u, 8u, values->innovation_var);
    put_word(data[4u], 34u, 24u, (uint32_t)(values->aiding_age - INT32_C(-1000)));
    put_word(data[3u], 51u, 9u, values->clock_var);
    put_word(data[5u], 8u, 16u, values->flags);
    put_word(data[5u], 24u, 22u, values->cycles);
    put_word(data[5u], 46u, 8u, values->overruns);
    put_word(data[6u], 8u, 12u, values->parameters_version);
    put_word(data[6u], 20u, 32u, values->parameters_hash_1);
    put_word(data[7u], 8u, 32u, values->parameters_hash_2);
    put_word(data[7u], 40u, 24u, (uint32_t)(values->alignment_x - INT32_C(-8388608)));
    put_word(data[8u], 8u, 24u, (uint32_t)(values->alignment_y - INT32_C(-8388608)));
    put_word(data[8u], 32u, 24u, (uint32_t)(values->alignment_z - INT32_C(-8388608)));
    put_word(data[9u], 8u, 16u, values->epoch);
    put_word(data[9u], 24u, 28u, values->numbered);
    return BORECHAIN_NATIVE_TAKEN;
}

int borechain_native_unpack_node_state_classic(
    uint8_t data[BORECHAIN_NATIVE_NODE_STATE_PARTS][8],
    const uint8_t lengths[BORECHAIN_NATIVE_NODE_STATE_PARTS],
    struct borechain_native_node_state *values)
{
    struct borechain_native_node_state found;
    int refused;
    unsigned part;
    for (part = 0u; part < BORECHAIN_NATIVE_NODE_STATE_PARTS; part++) {
        if (lengths[part] != borechain_native_node_state_lengths[part]) {
            return BORECHAIN_NATIVE_BAD_LENGTH;
        }
    }
    found.tube = (uint8_t)get_word(data[0u], 8u, 8u);
    found.at = (int64_t)((int64_t)get_long(data[0u], 16u, 48u) + INT64_C(-140737488355328));
    found.hops = (int16_t)((int32_t)get_word(data[1u], 8u, 8u) + INT32_C(-1));
    found.mode = (uint8_t)get_word(data[1u], 16u, 3u);
    found.yaw = get_word(data[1u], 19u, 24u);
    found.yaw_var = (uint8_t)get_word(data[1u], 43u, 8u);
    found.systematic_var = (uint8_t)get_word(data[1u], 51u, 8u);
    found.gyro_bias_x = (int32_t)((int32_t)get_word(data[2u], 8u, 22u) + INT32_C(-2097152));
    found.gyro_bias_y = (int32_t)((int32_t)get_word(data[2u], 30u, 22u) + INT32_C(-2097152));
    found.gyro_bias_z = (int32_t)((int32_t)get_word(data[3u], 8u, 22u) + INT32_C(-2097152));
    found.scale_factor = (int32_t)((int32_t)get_word(data[3u], 30u, 21u) + INT32_C(-1048576));
    found.innovation = (int32_t)((int32_t)get_word(data[4u], 8u, 26u) + INT32_C(-33554432));
    found.innovation_var = (uint8_t)get_word(data[2u], 52u, 8u);
    found.aiding_age = (int32_t)((int32_t)get_word(data[4u], 34u, 24u) + INT32_C(-1000));
    found.clock_var = (uint16_t)get_word(data[3u], 51u, 9u);
    found.flags = (uint16_t)get_word(data[5u], 8u, 16u);
    found.cycles = get_word(data[5u], 24u, 22u);
    found.overruns = (uint8_t)get_word(data[5u], 46u, 8u);
    found.parameters_version = (uint16_t)get_word(data[6u], 8u, 12u);
    found.parameters_hash_1 = get_word(data[6u], 20u, 32u);
    found.parameters_hash_2 = get_word(data[7u], 8u, 32u);
    found.alignment_x = (int32_t)((int32_t)get_word(data[7u], 40u, 24u) + INT32_C(-8388608));
    found.alignment_y = (int32_t)((int32_t)get_word(data[8u], 8u, 24u) + INT32_C(-8388608));
    found.alignment_z = (int32_t)((int32_t)get_word(data[8u], 32u, 24u) + INT32_C(-8388608));
    found.epoch = (uint16_t)get_word(data[9u], 8u, 16u);
    found.numbered = get_word(data[9u], 24u, 28u);
    refused = check_node_state(&found);
    if (refused == 0) {
        *values = found;
    }
    return refused;
}
