/* Seals of one end of one joint, as Python has them (telemetry/transport/joint_seal.py): every frame of the link under
 * the key of its two processes, and none twice.
 *
 * A frame names the random session number of either end. It is believed when its tag fits and it names this end's present
 * session; a call, under a key of the whole rig, begins. Times are of a counter of milliseconds that may run over.
 */
#ifndef BORECHAIN_JOINT_SEAL_H
#define BORECHAIN_JOINT_SEAL_H

#include "seal.h"
#include "seal_counts.h"

#define JOINT_HEAD 25u /* version, generation, newest, sender, addressee, own session, other's session, number */
#define JOINT_OVERHEAD (JOINT_HEAD + SEAL_TAG_SIZE)

/* A session of the other end. */
struct joint_session {
    uint64_t session;
    uint8_t address;
    uint8_t newest; /* generation of its keys */
};

struct joint_seal {
    struct seal_lots *lots;
    struct seal_counts *counts;
    uint64_t session;
    struct joint_session partner; /* proven */
    struct joint_session claim;   /* claimed, and not proven */
    struct seal_window window;
    uint32_t number;
    uint32_t partner_since_ms;
    uint32_t partner_heard_ms;
    uint32_t claimed_ms;
    uint32_t claim_frames; /* sealed for it, and of no effect */
    uint32_t answered_ms;
    uint32_t called_ms;
    uint8_t address;
    bool has_partner;
    bool has_claim;
    bool is_answer_due;
    bool is_confirm_due;
    bool has_answered;
    bool has_called;
};

void joint_begin(struct joint_seal *joint, uint8_t address, struct seal_lots *lots, struct seal_counts *counts);
/* Length of the content of a frame that came, which begins JOINT_HEAD behind it; 0 where it takes no effect. */
uint32_t joint_open(struct joint_seal *joint, const uint8_t *frame, uint32_t length, uint32_t now_ms);
/* Seals the content that lies JOINT_HEAD behind the front of a room; length of the frame, 0 without a proven session. */
uint32_t joint_close(struct joint_seal *joint, uint8_t *room, uint32_t length, uint32_t size);
/* The call, the answer or the first frame to a new partner, one a call, in this order: answer, first frame, call. */
uint32_t joint_own_frame(struct joint_seal *joint, uint8_t *room, uint32_t size, uint32_t now_ms);

#endif
