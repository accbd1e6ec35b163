/* A node's parameter block on a chip, see chip_block.h. */
#include "chip_block.h"

#include <string.h>

#include "block_numbers.h"
#include "block_words.h"
#include "borechain_orders.h"
#include "chip_node.h"
#include "node_memory.h"

#define AGREEING 4u   /* cycles at rest that a block fits, until it is taken */
#define DIFFERING 8u  /* that it does not fit, until it is refused */
#define ALL_SEGMENTS ((1u << BLOCK_PARTS) - 1u)
#define UNTRUSTED_EVERY_MS 60000u
#define LARGEST_VERSION 4095 /* of a native state */

void block_begin(struct chip_node *node)
{
    struct block_kept *const kept = &node->kept.block;
    memset(kept, 0, sizeof *kept);
    block_identity(node->identity.tube, kept->bytes);
    block_hash(kept->bytes, kept->in_use);
}

static void forget_upload(struct chip_node *node)
{
    node->kept.block.coming = node->kept.block.received = 0u;
    node->update.is_checked = false;
    node->save_is_due = true;
}

/* Believed segments */

static bool is_authentic(const struct chip_node *node, const struct word_segment *segment)
{
    static const uint8_t domain[] = "borechain block segment 1";
    const uint64_t upload = (uint64_t)segment->upload;
    const uint32_t version = (uint32_t)segment->version;
    struct hmac_sha256 hmac;
    uint8_t place[18] = {0u}, tag[SHA256_SIZE];
    uint32_t k;
    place[0] = node->identity.tube;
    for (k = 0u; k < 8u; k++) {
        place[2u + k] = (uint8_t)(upload >> (8u * k) & 0xFFu);
    }
    for (k = 0u; k < 4u; k++) {
        place[10u + k] = (uint8_t)(version >> (8u * k) & 0xFFu);
    }
    place[14] = (uint8_t)segment->count;
    place[16] = (uint8_t)segment->index;
    hmac_begin(&hmac, node->identity.block_key, BLOCK_KEY_SIZE);
    hmac_add(&hmac, domain, sizeof domain - 1u);
    hmac_add(&hmac, place, sizeof place);
    hmac_add(&hmac, segment->digest, SHA256_SIZE);
    hmac_add(&hmac, segment->data, segment->length);
    hmac_end(&hmac, tag);
    return digests_agree(tag, segment->tag);
}

static const char *distrust(const struct chip_node *node, const struct word_segment *segment)
{
    if (node->identity.block_key == NULL) {
        return "the node has no key of the rig";
    }
    return segment->index < segment->count && is_authentic(node, segment) ? NULL
                                                                         : "the tag is not of the node's key";
}

static void tell_untrusted(struct chip_node *node, const struct word_segment *segment, const char *reason)
{
    struct block_update *const update = &node->update;
    struct mail_item *item;
    update->untrusted++;
    if (update->is_untrusted_told && node_ms(node->now_us) - update->untrusted_at_ms < UNTRUSTED_EVERY_MS) {
        return;
    }
    item = node_mail_place(node, false);
    if (item != NULL) {
        const struct word_origin origin = node_origin(node, item->number);
        update->is_untrusted_told = true;
        update->untrusted_at_ms = node_ms(node->now_us);
        node_keep(node, item,
            word_untrusted(&origin, segment->version, reason, update->untrusted, item->payload, MAIL_ROOM));
    }
}

static void answer(
    struct chip_node *node,
    int64_t upload,
    const uint8_t digest[SHA256_SIZE],
    enum block_phase phase,
    const char *detail)
{
    struct block_answer *const made = &node->update.answer;
    made->upload = upload;
    memcpy(made->digest, digest, SHA256_SIZE);
    made->phase = (uint8_t)phase;
    made->detail = detail;
    made->is_due = true;
}

static void refuse(struct chip_node *node, const char *reason)
{
    struct block_update *const update = &node->update;
    const struct block_kept *const kept = &node->kept.block;
    struct mail_item *const item = node_mail_place(node, true);
    update->reason = reason;
    update->refused_upload = update->upload;
    memcpy(update->refused, kept->digest, SHA256_SIZE);
    if (item != NULL) {
        const struct word_origin origin = node_origin(node, item->number);
        node_keep(node, item, word_refused(&origin, kept->coming, reason, kept->version, item->payload, MAIL_ROOM));
    }
    answer(node, update->upload, kept->digest, BLOCK_REFUSED, reason);
    forget_upload(node);
}

static bool is_of_upload(const struct block_kept *kept, const struct word_segment *segment)
{
    return kept->coming == (uint32_t)segment->version && memcmp(kept->digest, segment->digest, SHA256_SIZE) == 0;
}

static void gather(struct chip_node *node, const struct word_segment *segment)
{
    struct block_kept *const kept = &node->kept.block;
    const uint32_t index = (uint32_t)segment->index, begin = BLOCK_PART * index;
    if (!is_of_upload(kept, segment)) {
        kept->coming = (uint32_t)segment->version;
        memcpy(kept->digest, segment->digest, SHA256_SIZE);
        kept->received = 0u;
        node->update.is_checked = false;
        node->update.agreed = node->update.differed = 0u;
    }
    if (segment->count != BLOCK_PARTS ||
        segment->length != (index + 1u < BLOCK_PARTS ? BLOCK_PART : BLOCK_SIZE - begin)) {
        refuse(node, "parameter block: expected 796 bytes in segments of 192");
        return;
    }
    if ((kept->received >> index & 1u) == 0u) {
        memcpy(&kept->bytes[begin], segment->data, segment->length);
        kept->received |= 1u << index;
        node->save_is_due = true;
    }
    answer(node, segment->upload, segment->digest, node->update.is_checked ? BLOCK_WAITING : BLOCK_PARTIAL, "");
}

void block_on_segment(struct chip_node *node, const uint8_t *payload, uint32_t length)
{
    struct block_update *const update = &node->update;
    const struct block_kept *const kept = &node->kept.block;
    struct word_segment segment;
    const char *reason;
    if (!word_segment(payload, length, &segment)) {
        return;
    }
    reason = distrust(node, &segment);
    if (reason != NULL) {
        tell_untrusted(node, &segment, reason);
        answer(node, segment.upload, segment.digest, BLOCK_UNTRUSTED, reason);
        return;
    }
    update->upload = segment.upload;
    if (memcmp(segment.digest, kept->in_use, SHA256_SIZE) == 0) {
        answer(node, segment.upload, segment.digest, BLOCK_APPLIED, "");
    } else if (update->reason != NULL && update->refused_upload == segment.upload &&
               memcmp(segment.digest, update->refused, SHA256_SIZE) == 0) {
        answer(node, segment.upload, segment.digest, BLOCK_REFUSED, update->reason);
    } else if (segment.version > LARGEST_VERSION) {
        answer(node, segment.upload, segment.digest, BLOCK_REFUSED, "version: expected at most 4095, as a state has it");
    } else if (segment.version <= kept->version) {
        answer(node, segment.upload, segment.digest, BLOCK_REFUSED, "version: expected newer than the one in use");
    } else if (segment.version < kept->coming) {
        answer(node, segment.upload, segment.digest, BLOCK_REFUSED, "version: a newer one is being uploaded");
    } else {
        gather(node, &segment);
    }
}

/* Whole blocks */

static const char *unfit_of(int64_t finding)
{
    static const char *const gyroscope[] = {NULL, "gyroscope: expected a reference of -20..85 C",
        "gyroscope: expected a right-handed matrix of condition up to 4",
        "gyroscope: expected a matrix that drifts by at most 0.1", "gyroscope: expected a bias of at most 0.349",
        "gyroscope: expected a matrix within 0.2 of the identity or the last"};
    static const char *const accelerometer[] = {NULL, "accelerometer: expected a reference of -20..85 C",
        "accelerometer: expected a right-handed matrix of condition up to 4",
        "accelerometer: expected a matrix that drifts by at most 0.1", "accelerometer: expected a bias of at most 2",
        "accelerometer: expected a matrix within 0.2 of the identity or the last"};
    return finding < BORECHAIN_ACCELEROMETER ? gyroscope[finding] : accelerometer[finding - BORECHAIN_ACCELEROMETER];
}

static const char *unfit(struct chip_node *node, struct borechain_parameters *corrections)
{
    struct block_kept *const kept = &node->kept.block;
    uint8_t digest[SHA256_SIZE];
    enum block_fault fault;
    block_hash(kept->bytes, digest);
    if (!digests_agree(digest, kept->digest)) {
        return "the hash of the whole does not fit";
    }
    fault = block_check(kept->bytes);
    if (fault != BLOCK_WHOLE) {
        return fault == BLOCK_NOT_FINITE ? "parameter block: expected finite numbers, got some that are not"
                                         : "parameter block: expected format 1";
    }
    if (block_version(kept->bytes) != kept->coming) {
        return "version: expected that of its segments";
    }
    if (block_tube(kept->bytes) != node->identity.tube) {
        return "tube: expected this one";
    }
    block_corrections(kept->bytes, corrections);
    return unfit_of(borechain_judge_block(node->kept.corrections, corrections));
}

static void check(struct chip_node *node)
{
    struct borechain_parameters corrections;
    const char *const reason = unfit(node, &corrections);
    if (reason != NULL) {
        refuse(node, reason);
        return;
    }
    node->update.is_checked = true;
    node->update.agreed = node->update.differed = 0u;
    answer(node, node->update.upload, node->kept.block.digest, BLOCK_WAITING, "");
}

static void tell_applied(struct chip_node *node, uint32_t before)
{
    struct mail_item *const item = node_mail_place(node, false);
    if (item != NULL) {
        const struct word_origin origin = node_origin(node, item->number);
        node_keep(node, item, word_applied(&origin, &node->kept.block, before, item->payload, MAIL_ROOM));
    }
}

/* In place: a copy beside both would not fit the stack. */
static void exchange(struct borechain_parameters *one, struct borechain_parameters *other)
{
    uint8_t *const a = (uint8_t *)one, *const b = (uint8_t *)other;
    uint32_t k;
    for (k = 0u; k < sizeof *one; k++) {
        const uint8_t byte = a[k];
        a[k] = b[k];
        b[k] = byte;
    }
}

/* Puts the block that came in use and saves; where the flash does not take it the one before stays. */
static void take(struct chip_node *node, struct borechain_parameters *corrections)
{
    struct block_kept *const kept = &node->kept.block;
    struct borechain_parameters *const in_use = node->kept.corrections;
    const uint32_t version = kept->version, coming = kept->coming;
    const int64_t changes = block_changes(in_use, corrections);
    uint8_t before[SHA256_SIZE];
    memcpy(before, kept->in_use, sizeof before);
    exchange(in_use, corrections);
    (void)borechain_take_block(&node->record, &node->settings, corrections, in_use, changes);
    block_hash(kept->bytes, kept->in_use);
    kept->version = coming;
    kept->coming = kept->received = 0u;
    memory_save(node, node_ms(node->now_us));
    if (node->refused != 0u) {
        (void)borechain_take_block(&node->record, &node->settings, in_use, corrections, changes);
        exchange(in_use, corrections);
        memcpy(kept->in_use, before, sizeof before);
        kept->version = version;
        kept->coming = coming;
        refuse(node, "flash: it does not take the block");
        return;
    }
    node->update.is_checked = false;
    tell_applied(node, version);
    answer(node, node->update.upload, kept->in_use, BLOCK_APPLIED, "");
}

void block_on_cycle(struct chip_node *node)
{
    struct block_update *const update = &node->update;
    struct borechain_parameters corrections;
    int64_t rate[3], force[3], found;
    if (!update->is_checked) {
        return;
    }
    block_corrections(node->kept.block.bytes, &corrections);
    memcpy(rate, node->record.raw_rate, sizeof rate);
    memcpy(force, node->record.raw_force, sizeof force);
    found = borechain_try_block(&node->record, &corrections, rate, force);
    if (found == BORECHAIN_AGREES) {
        update->agreed++;
    } else {
        update->agreed = 0u;
    }
    if (found == BORECHAIN_DIFFERS) {
        update->differed++;
    } else if (found != BORECHAIN_MAY_TURN) {
        update->differed = 0u;
    }
    if (update->agreed >= AGREEING) {
        take(node, &corrections);
    } else if (update->differed >= DIFFERING) {
        refuse(node, "at rest it gives another rate than none, or another force than gravity");
    }
}

static void send_answer(struct chip_node *node)
{
    struct block_update *const update = &node->update;
    struct hop_link *const link = &node->ends[NODE_UPPER].link;
    const struct block_kept *const kept = &node->kept.block;
    const bool is_gathered = kept->coming != 0u && memcmp(update->answer.digest, kept->digest, SHA256_SIZE) == 0;
    uint32_t length;
    if (link_holds(link, update->room)) {
        return; /* the newest goes when the one before has arrived */
    }
    length = word_status(node->identity.tube, &update->answer,
        is_gathered && update->answer.phase != BLOCK_UNTRUSTED ? kept->received : 0u, kept, update->room,
        BLOCK_STATUS_ROOM);
    update->answer.is_due = length > 0u && !link_send(link, update->room, length);
}

void block_advance(struct chip_node *node)
{
    if (node->kept.block.received == ALL_SEGMENTS && !node->update.is_checked) {
        check(node);
    }
    if (node->update.answer.is_due && (!node->save_is_due || node->refused != 0u)) {
        send_answer(node);
    }
}
