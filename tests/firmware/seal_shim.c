/* The seals of one process for their tests. */
#include <stddef.h>
#include <string.h>

#include "end_seal.h"
#include "joint_seal.h"

static struct seal_lots lots;
static struct seal_counts counts;
static struct joint_seal joint;
static struct end_seal end;

bool shim_keys(const uint8_t *page, uint32_t size, uint8_t tube, uint32_t boots);
void shim_begin(uint8_t tube);
uint32_t shim_open(const uint8_t *frame, uint32_t length, uint32_t now_ms);
uint32_t shim_close(uint8_t *room, uint32_t length, uint32_t size);
uint32_t shim_own(uint8_t *room, uint32_t size, uint32_t now_ms);
uint32_t shim_end_close(const uint8_t *content, uint32_t length, uint8_t *head);
bool shim_end_open(const uint8_t *payload, uint32_t length, bool is_offer, uint32_t now_ms);
bool shim_admits(const uint64_t *numbers, uint32_t epoch, bool is_under_torque, const uint8_t *seal, uint8_t length,
    int64_t valid_us, uint32_t own_epoch, int64_t rig_us);
uint32_t shim_count(uint32_t reason);
const char *shim_told(uint32_t now_ms, uint32_t *refused);

bool shim_keys(const uint8_t *page, uint32_t size, uint8_t tube, uint32_t boots)
{
    memset(&lots, 0, sizeof lots);
    lots.boots = boots;
    return keys_open(&lots.ring, page, size, tube);
}

void shim_begin(uint8_t tube)
{
    memset(&counts, 0, sizeof counts);
    joint_begin(&joint, tube, &lots, &counts);
    end_begin(&end, tube, &lots, &counts);
}

uint32_t shim_open(const uint8_t *frame, uint32_t length, uint32_t now_ms)
{
    return joint_open(&joint, frame, length, now_ms);
}

uint32_t shim_close(uint8_t *room, uint32_t length, uint32_t size)
{
    return joint_close(&joint, room, length, size);
}

uint32_t shim_own(uint8_t *room, uint32_t size, uint32_t now_ms)
{
    return joint_own_frame(&joint, room, size, now_ms);
}

uint32_t shim_end_close(const uint8_t *content, uint32_t length, uint8_t *head)
{
    return end_close(&end, content, length, head);
}

bool shim_end_open(const uint8_t *payload, uint32_t length, bool is_offer, uint32_t now_ms)
{
    return end_open(&end, payload, length, is_offer, now_ms);
}

bool shim_admits(const uint64_t *numbers, uint32_t epoch, bool is_under_torque, const uint8_t *seal, uint8_t length,
    int64_t valid_us, uint32_t own_epoch, int64_t rig_us)
{
    struct measured told = {numbers[0], numbers[1], numbers[2], numbers[3], numbers[4], numbers[5], epoch,
        is_under_torque, {0u}, length};
    memcpy(told.seal, seal, length);
    return end_admits(&end, &told, valid_us, own_epoch, rig_us);
}

uint32_t shim_count(uint32_t reason)
{
    return counts.count[reason];
}

const char *shim_told(uint32_t now_ms, uint32_t *refused)
{
    return seal_counts_due(&counts, now_ms, refused);
}
