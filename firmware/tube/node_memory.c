/* What a node begins with, keeps, and forgets at a start, see node_memory.h. */
#include "node_memory.h"

#include <stddef.h>
#include <string.h>

#include "borechain_image.h"
#include "borechain_orders.h"

#define NO_NUMBER (INT64_C(1) << 60)
#define NEVER (-(INT64_C(1) << 62))
#define USUAL_TEMPERATURE (INT64_C(25) << 23) /* C, Q23 */
#define KEPT_RECORD offsetof(struct borechain_node, cycles)
#define KEPT_SIZE (offsetof(struct chip_node, record) + KEPT_RECORD)
#define STILL_WALK_LEAST 1
#define LONGEST_WORTH (INT64_C(1000000000) << 28)

static void forget_readings(struct borechain_readings *readings)
{
    uint32_t k;
    memset(readings, 0, sizeof *readings);
    for (k = 0u; k < 3u; k++) {
        readings->rates.last[k] = NO_NUMBER;
        readings->forces.last[k] = NO_NUMBER;
    }
}

static void forget_guard(struct borechain_guard *guard)
{
    forget_readings(&guard->readings);
    guard->aidings.at = NO_NUMBER;
    guard->aidings.left = 0;
    guard->aidings.seen = guard->aidings.wrong = 0;
    guard->rate = guard->sane_rate = guard->agreed_rate = guard->aiding_var = 0;
    guard->rate_at = NEVER;
    memset(&guard->swing, 0, sizeof guard->swing);
    guard->creep.cycles = guard->creep.waits = 0;
    guard->jumped = guard->untimely = guard->agreed = guard->rest_cycles = 0;
}

void memory_resume(struct borechain_node *record, const struct borechain_config *config)
{
    uint32_t k;
    memset((uint8_t *)record + KEPT_RECORD, 0, sizeof *record - KEPT_RECORD);
    record->temperature = USUAL_TEMPERATURE;
    for (k = 0u; k < BORECHAIN_IMUS; k++) {
        record->cluster.used[k] = 1;
        record->cluster.delayed[k].late = NO_NUMBER;
        forget_readings(&record->cluster.watches[k]);
    }
    forget_guard(&record->guard);
    record->twist.heard_at = NEVER;
    record->twist.torque = record->twist.holding = 0;
    record->twist.wound = 1;
    record->joints.hops = -1;
    record->joints.solved = 0;
    record->mount.aligning = 0;
    record->config = *config;
    (void)borechain_resume_filter(record);
}

/* An outage (s, Q28) after which a string at rest may have turned unseen by the yaw's sigma. */
static int64_t worth_of(const struct borechain_node *record)
{
    const int64_t walk = record->config.still_walk_var;
    const int64_t var = record->filter.now_P[2][2];
    if (record->filter.yaw_known == 0 || walk < STILL_WALK_LEAST) {
        return 0;
    }
    return var / walk < LONGEST_WORTH >> 28 ? var / walk * (INT64_C(1) << 28) : LONGEST_WORTH;
}

/* As new, from the image alone. */
static bool begin_anew(struct chip_node *node, const uint8_t *image, uint32_t image_size)
{
    memset(&node->kept, 0, sizeof node->kept);
    memcpy(node->kept.source, BORECHAIN_DIGEST, sizeof node->kept.source);
    node->kept.hops = -1;
    node->kept.mail.next_number = 1;
    block_begin(node);
    return borechain_load(image, image_size, &node->settings, node->kept.corrections, &node->record) ==
           BORECHAIN_LOADED;
}

bool memory_load(struct chip_node *node, const uint8_t *image, uint32_t image_size)
{
    struct borechain_config config;
    node->worth = -1;
    if (!begin_anew(node, image, image_size)) {
        return false;
    }
    config = node->record.config;
    slots_find(node->flash, &node->found);
    if (node->found.slot == SLOT_NONE || node->found.length != KEPT_SIZE) {
        return true;
    }
    slots_load(node->flash, &node->found, (uint8_t *)node);
    if (memcmp(node->kept.source, BORECHAIN_DIGEST, sizeof node->kept.source) != 0) {
        return begin_anew(node, image, image_size);
    }
    memcpy(&node->kept.corrections[1], borechain_image_corrections(image) + sizeof node->kept.corrections[0],
        sizeof node->kept.corrections - sizeof node->kept.corrections[0]); /* an image may be provisioned anew */
    node->worth = worth_of(&node->record);
    memory_resume(&node->record, &config);
    mail_resume(&node->kept.mail, 0u);
    return true;
}

void memory_save(struct chip_node *node, uint32_t now_ms)
{
    node->save_is_due = false;
    node->saved_at_ms = now_ms;
    if (slots_save(node->flash, &node->found, (const uint8_t *)node, KEPT_SIZE) != SLOT_SAVED) {
        node->refused++;
        return;
    }
    node->refused = 0u;
}
