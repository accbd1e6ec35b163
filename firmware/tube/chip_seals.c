/* All seals of a chip's node, see chip_seals.h. */
#include "chip_seals.h"

#include <stddef.h>
#include <string.h>

#include "chip_node.h"
#include "chip_words.h"
#include "hop_words.h"
#include "node_signals.h"
#include "word_envelope.h"

#define WARNING 1

static uint32_t open_frame(void *joint, const uint8_t *frame, uint32_t length, uint32_t now_ms)
{
    return joint_open(joint, frame, length, now_ms);
}

static uint32_t close_frame(void *joint, uint8_t *room, uint32_t length, uint32_t size)
{
    return joint_close(joint, room, length, size);
}

static uint32_t own_frame(void *joint, uint8_t *room, uint32_t size, uint32_t now_ms)
{
    return joint_own_frame(joint, room, size, now_ms);
}

static bool is_proven(const void *joint)
{
    return ((const struct joint_seal *)joint)->has_partner;
}

/* What goes to the base is sealed as it leaves: in memory and in flash it is as the receipt names it. */
static uint32_t close_payload(void *own, const uint8_t *payload, uint32_t length, uint8_t head[LINK_HEAD])
{
    const struct chip_node *const node = own;
    int64_t kind = 0, target = 0;
    if (end_is_sealed(payload, length) || !word_open(payload, length, &kind, &target) || kind < HOP_STATE) {
        return 0u; /* another's, or for one hop */
    }
    return end_close(&node->seals.end, payload, length, head);
}

bool seals_begin(struct chip_node *node, const uint8_t *page, uint32_t size, uint32_t nonce)
{
    struct chip_seals *const seals = &node->seals;
    uint32_t side;
    if (page == NULL) {
        return true;
    }
    if (!keys_open(&seals->lots.ring, page, size, node->identity.tube)) {
        return false;
    }
    seals->lots.boots = node->kept.boots;
    seals->lots.nonce = nonce;
    for (side = 0u; side < 2u; side++) {
        joint_begin(&seals->joints[side], node->identity.tube, &seals->lots, &seals->counts);
    }
    end_begin(&seals->end, node->identity.tube, &seals->lots, &seals->counts);
    return true;
}

bool seals_are_used(const struct chip_node *node)
{
    return node->seals.lots.ring.page != NULL;
}

void seals_join(struct chip_node *node, uint32_t side, struct chip_end_calls *calls)
{
    static const struct chip_end_seal joint_calls = {open_frame, close_frame, own_frame, is_proven};
    if (seals_are_used(node)) {
        calls->seal = &joint_calls;
        calls->joint = &node->seals.joints[side];
        calls->close_payload = side == NODE_UPPER ? close_payload : NULL;
    }
}

const uint8_t *seals_content(const struct chip_node *node, const uint8_t *payload, uint32_t *length)
{
    if (!seals_are_used(node) || !end_is_sealed(payload, *length)) {
        return payload;
    }
    *length -= END_OVERHEAD;
    return &payload[END_OVERHEAD];
}

bool seals_hear(struct chip_node *node, const uint8_t *payload, uint32_t length, bool is_offer)
{
    if (!seals_are_used(node)) {
        return !is_offer;
    }
    if (!end_open(&node->seals.end, payload, length, is_offer, node_ms(node->now_us))) {
        return false;
    }
    if (is_offer) {
        node->seals.too_old = 0;
        node->seals.answered = 0u;
        mail_resume(&node->kept.mail, node_ms(node->now_us)); /* what was sent without a session was not believed */
    }
    return true;
}

bool seals_admit(struct chip_node *node, const struct measured *told, int64_t valid_us)
{
    const int64_t rig_us = clock_rig_from_local(&node->clock, node->now_us);
    return !seals_are_used(node) ||
           end_admits(&node->seals.end, told, valid_us, node->clock.told.epoch, rig_us);
}

bool seals_obey(struct chip_node *node, int64_t order)
{
    const bool is_new = !seals_are_used(node) || order > node->seals.too_old;
    node->seals.counts.count[SEAL_END_OLD_ORDER] += is_new ? 0u : 1u;
    return is_new;
}

void seals_answered(struct chip_node *node, int64_t forgotten)
{
    struct chip_seals *const seals = &node->seals;
    if (seals->answered >= NODE_ANSWERS && forgotten > seals->too_old) {
        seals->too_old = forgotten;
    }
    seals->answered++;
}

void seals_tell(struct chip_node *node)
{
    uint32_t refused = 0u;
    struct mail_item *item;
    const char *const reason = seal_counts_due(&node->seals.counts, node_ms(node->now_us), &refused);
    if (reason == NULL) {
        return;
    }
    item = node_mail_place(node, false);
    if (item != NULL) {
        const struct word_origin origin = node_origin(node, item->number);
        struct pack_writer to = {item->payload, MAIL_ROOM, 0u};
        word_begin_event(&to, &origin, WARNING, "seal_refused");
        pack_map(&to, 2u);
        word_integer(&to, "refused", refused);
        pack_text(&to, "mostly");
        pack_text(&to, reason);
        word_end(&to, &origin);
        node_keep(node, item, packed_length(&to));
    }
}
