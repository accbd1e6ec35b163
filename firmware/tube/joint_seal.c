/* Seals of one end of one joint, see joint_seal.h. */
#include "joint_seal.h"

#include <stddef.h>
#include <string.h>

#include "little_endian.h"

#define VERSION 1u
#define ANYBODY 255u /* addressee of a call */
#define CALL_EVERY_MS 1000u
#define UNHEARD_MS 1500u       /* without a frame of the other end, after which this end calls */
#define ANSWER_EVERY_MS 100u
#define PROOF_WITHIN_MS 3000u
#define DUPLICATE_WITHIN_MS 500u
#define SETTLED_MS 5000u

void joint_begin(struct joint_seal *joint, uint8_t address, struct seal_lots *lots, struct seal_counts *counts)
{
    memset(joint, 0, sizeof *joint);
    joint->address = address;
    joint->lots = lots;
    joint->counts = counts;
    joint->session = lots_draw(lots);
}

static void refuse(struct joint_seal *joint, enum seal_reason reason)
{
    joint->counts->count[reason]++;
}

static const uint8_t *key_of(const struct joint_seal *joint, uint8_t generation, uint8_t other, bool is_call)
{
    const struct key_ring *const ring = &joint->lots->ring;
    if (keys_find(ring, keys_newest(ring), KEY_JOINT, other) == NULL && other != joint->address) {
        return NULL; /* revoked: its calls are not heard either */
    }
    return keys_find(ring, generation, is_call ? KEY_CALL : KEY_JOINT, other);
}

/* Seals the content of a room for an addressee. */
static uint32_t sealed(
    struct joint_seal *joint,
    uint8_t addressee,
    uint64_t session,
    uint8_t others_newest,
    uint8_t *room,
    uint32_t length,
    uint32_t size)
{
    const struct key_ring *const ring = &joint->lots->ring;
    const uint8_t generation = keys_common(ring, others_newest);
    const bool is_call = addressee == ANYBODY;
    const uint8_t *const secret = key_of(joint, generation, is_call ? joint->address : addressee, is_call);
    uint8_t tag[SEAL_BLOCK];
    struct seal_key key;
    if (secret == NULL || size < JOINT_OVERHEAD || length > size - JOINT_OVERHEAD) {
        return 0u;
    }
    if (joint->number == UINT32_MAX) {
        joint->session = lots_draw(joint->lots);
        joint->number = 0u;
    }
    joint->number++;
    room[0] = VERSION;
    room[1] = generation;
    room[2] = keys_newest(ring);
    room[3] = joint->address;
    room[4] = addressee;
    put_little_endian(&room[5], joint->session, 8u);
    put_little_endian(&room[13], session, 8u);
    put_little_endian(&room[21], joint->number, 4u);
    seal_set_key(&key, secret);
    seal_tag(&key, room, JOINT_HEAD + length, tag);
    memcpy(&room[JOINT_HEAD + length], tag, SEAL_TAG_SIZE);
    return JOINT_OVERHEAD + length;
}

static void drop_claim(struct joint_seal *joint)
{
    if (joint->has_claim) {
        joint->counts->count[SEAL_OLD_SESSION] += joint->claim_frames;
    }
    joint->has_claim = false;
    joint->is_answer_due = false;
}

static bool is_same(const struct joint_session *one, const struct joint_session *other)
{
    return one->address == other->address && one->session == other->session;
}

/* A sender that does not know this end's session: it is told, and has to prove that it can use it. */
static void take_claim(struct joint_seal *joint, const struct joint_session *from, uint32_t now_ms, bool is_call)
{
    if (joint->has_partner && !is_call && is_same(&joint->partner, from)) {
        refuse(joint, now_ms - joint->partner_since_ms < SETTLED_MS ? SEAL_LATE : SEAL_OLD_SESSION);
        return; /* it knows this end's session */
    }
    if (!joint->has_claim || !is_same(&joint->claim, from)) {
        drop_claim(joint);
        joint->has_claim = true;
        joint->claim = *from;
        joint->claimed_ms = now_ms;
        joint->claim_frames = 0u;
    }
    joint->claim_frames += is_call ? 0u : 1u;
    joint->is_answer_due = true;
}

static bool take_number(struct joint_seal *joint, const struct joint_session *from, uint32_t number, uint32_t now_ms)
{
    if (!joint->has_partner || !is_same(&joint->partner, from)) {
        joint->has_partner = true;
        joint->partner = *from;
        joint->partner_since_ms = now_ms;
        joint->partner_heard_ms = now_ms;
        memset(&joint->window, 0, sizeof joint->window);
        joint->has_claim = false;
        joint->is_answer_due = false;
        joint->is_confirm_due = true;
    }
    if (!seal_admit(&joint->window, number)) {
        /* the newest once more, at once, is the medium's doing */
        const bool is_duplicate =
            number == joint->window.largest && now_ms - joint->partner_heard_ms <= DUPLICATE_WITHIN_MS;
        refuse(joint, is_duplicate ? SEAL_DUPLICATE : SEAL_REPEATED);
        return false;
    }
    joint->partner.newest = from->newest;
    joint->partner_heard_ms = now_ms;
    return true;
}

static bool is_settled(const struct joint_seal *joint, uint32_t now_ms)
{
    return joint->has_partner && now_ms - joint->partner_since_ms > SETTLED_MS &&
           now_ms - joint->partner_heard_ms < UNHEARD_MS;
}

uint32_t joint_open(struct joint_seal *joint, const uint8_t *frame, uint32_t length, uint32_t now_ms)
{
    struct joint_session from;
    const uint8_t *secret;
    struct seal_key key;
    uint32_t content;
    if (length < JOINT_OVERHEAD || frame[0] != VERSION) {
        refuse(joint, SEAL_UNSEALED);
        return 0u;
    }
    content = length - JOINT_OVERHEAD;
    if (frame[4] != joint->address && frame[4] != ANYBODY) {
        refuse(joint, is_settled(joint, now_ms) ? SEAL_WRONG_JOINT : SEAL_BEFORE_JOINED);
        return 0u;
    }
    from.address = frame[3];
    from.newest = frame[2];
    from.session = little_endian(&frame[5], 8u);
    secret = from.address == joint->address ? NULL : key_of(joint, frame[1], from.address, frame[4] == ANYBODY);
    if (secret != NULL) {
        seal_set_key(&key, secret);
    }
    if (secret == NULL || !seal_fits(&key, frame, length - SEAL_TAG_SIZE, &frame[length - SEAL_TAG_SIZE])) {
        refuse(joint, SEAL_WRONG_TAG);
        return 0u;
    }
    if (frame[4] == ANYBODY || little_endian(&frame[13], 8u) != joint->session) {
        take_claim(joint, &from, now_ms, frame[4] == ANYBODY);
        return 0u;
    }
    return take_number(joint, &from, (uint32_t)little_endian(&frame[21], 4u), now_ms) ? content : 0u;
}

uint32_t joint_close(struct joint_seal *joint, uint8_t *room, uint32_t length, uint32_t size)
{
    const struct joint_session *const to = &joint->partner;
    return joint->has_partner ? sealed(joint, to->address, to->session, to->newest, room, length, size) : 0u;
}

uint32_t joint_own_frame(struct joint_seal *joint, uint8_t *room, uint32_t size, uint32_t now_ms)
{
    const bool may_answer = !joint->has_answered || now_ms - joint->answered_ms >= ANSWER_EVERY_MS;
    const bool may_call = !joint->has_called || now_ms - joint->called_ms >= CALL_EVERY_MS;
    if (joint->is_answer_due && joint->has_claim && may_answer) {
        joint->has_answered = true;
        joint->answered_ms = now_ms;
        joint->is_answer_due = false;
        return sealed(joint, joint->claim.address, joint->claim.session, joint->claim.newest, room, 0u, size);
    }
    if (joint->is_confirm_due) {
        joint->is_confirm_due = false;
        return joint_close(joint, room, 0u, size);
    }
    if (joint->has_claim && now_ms - joint->claimed_ms > PROOF_WITHIN_MS) {
        drop_claim(joint);
    }
    if (may_call && (!joint->has_partner || now_ms - joint->partner_heard_ms > UNHEARD_MS)) {
        joint->has_called = true;
        joint->called_ms = now_ms;
        return sealed(joint, ANYBODY, 0u, keys_oldest(&joint->lots->ring), room, 0u, size);
    }
    return 0u;
}
