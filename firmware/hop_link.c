/* One joint's link, see hop_link.h. */
#include "hop_link.h"

#include <string.h>

#define BOOT_SHIFT 24u
#define SESSION_SHIFT 8u
#define SESSION_MASK 0xFFFFu
#define FIRST_TIMEOUT_MS 60u /* one round trip and the wait of a lonely acknowledgement */
#define LAST_TIMEOUT_MS 2000u
#define ACK_DELAY_MS 20u

/* Whether a time has come, of a counter that runs over. */
static bool has_come(uint32_t at_ms, uint32_t now_ms)
{
    return now_ms - at_ms < UINT32_C(0x80000000);
}

static void name_session(struct hop_link *link)
{
    link->epoch =
        (uint64_t)link->boot_count << BOOT_SHIFT | (uint64_t)link->session << SESSION_SHIFT | (uint64_t)link->address;
    link->next_number = 1u;
}

void link_begin(struct hop_link *link, uint8_t address, uint32_t boot_count)
{
    memset(link, 0, sizeof *link);
    link->address = address;
    link->boot_count = boot_count;
    name_session(link);
}

bool link_is_up(const struct hop_link *link, uint32_t now_ms)
{
    return link->was_heard && !has_come(link->last_heard_ms + LINK_SILENCE_MS + 1u, now_ms);
}

void link_hear_signals(struct hop_link *link, uint32_t now_ms)
{
    link->was_heard = true;
    link->last_heard_ms = now_ms;
}

bool link_holds(const struct hop_link *link, const uint8_t *payload)
{
    uint32_t k;
    for (k = 0u; k < link->count; k++) {
        if (link->slots[k].payload == payload) {
            return true;
        }
    }
    return false;
}

bool link_send(struct hop_link *link, const uint8_t *payload, uint32_t length)
{
    struct link_slot *slot;
    uint32_t k;
    for (k = 0u; k < link->count; k++) {
        slot = &link->slots[k];
        if (slot->length == length && memcmp(slot->payload, payload, length) == 0) {
            return true;
        }
    }
    if (link->count == LINK_SLOTS) {
        return false;
    }
    slot = &link->slots[link->count];
    memset(slot, 0, sizeof *slot);
    slot->payload = payload;
    slot->length = length;
    link->count++;
    return true;
}

/* Whether an epoch is of a session that this peer has ended: its frames were late. */
static bool is_of_before(const struct hop_link *link, uint64_t epoch)
{
    const uint64_t since = ((link->peer_epoch >> SESSION_SHIFT) - (epoch >> SESSION_SHIFT)) & SESSION_MASK;
    return epoch >> BOOT_SHIFT == link->peer_epoch >> BOOT_SHIFT && (epoch & 0xFFu) == (link->peer_epoch & 0xFFu) &&
           since > 0u && since <= SESSION_MASK >> 1;
}

/* Our numbers begin anew: what waits is sent again. */
static void restart(struct hop_link *link)
{
    uint32_t k;
    link->session++;
    name_session(link);
    for (k = 0u; k < link->count; k++) {
        link->slots[k].number = 0u;
    }
}

/* Another process at the other end: its numbers and ours begin anew. Its new session: its numbers do. */
static void follow_peer(struct hop_link *link, uint64_t sender, uint64_t epoch)
{
    const bool is_other = !link->has_peer || sender != link->peer_sender ||
                          epoch >> BOOT_SHIFT != link->peer_epoch >> BOOT_SHIFT;
    if (is_other && link->has_peer) {
        restart(link);
    }
    if (is_other || epoch != link->peer_epoch) {
        link->received = 0u;
        link->received_mask = 0u;
    }
    link->has_peer = true;
    link->peer_sender = sender;
    link->peer_epoch = epoch;
}

static bool is_acknowledged(const struct link_slot *slot, const struct link_header *header)
{
    uint64_t ahead;
    if (slot->number == 0u) {
        return false;
    }
    if (slot->number <= header->acknowledged) {
        return true;
    }
    ahead = slot->number - header->acknowledged - 1u;
    return ahead < LINK_WINDOW && (header->mask >> ahead & 1u) != 0u;
}

static void drop_acknowledged(struct hop_link *link, const struct link_header *header)
{
    uint32_t kept = 0u;
    uint32_t k;
    for (k = 0u; k < link->count; k++) {
        if (!is_acknowledged(&link->slots[k], header)) {
            link->slots[kept] = link->slots[k];
            kept++;
        }
    }
    link->count = kept;
}

/* Whether the other end lacks what it acknowledged before: it met another meanwhile. */
static bool has_forgotten(const struct hop_link *link, const struct link_header *header)
{
    uint64_t oldest = link->next_number;
    uint32_t k;
    for (k = 0u; k < link->count; k++) {
        if (link->slots[k].number > 0u && link->slots[k].number < oldest) {
            oldest = link->slots[k].number;
        }
    }
    return header->acknowledged + 1u < oldest;
}

static bool is_new(struct hop_link *link, uint64_t number, uint32_t now_ms)
{
    uint64_t ahead;
    if (!link->is_ack_due) {
        link->is_ack_due = true;
        link->ack_due_ms = now_ms + ACK_DELAY_MS;
    }
    if (number <= link->received) {
        return false;
    }
    ahead = number - link->received - 1u;
    if (ahead >= LINK_WINDOW || (link->received_mask >> ahead & 1u) != 0u) {
        return false;
    }
    link->received_mask |= UINT64_C(1) << ahead;
    while ((link->received_mask & 1u) != 0u) {
        link->received_mask >>= 1;
        link->received++;
    }
    return true;
}

enum link_answer link_receive(
    struct hop_link *link,
    const uint8_t *frame,
    uint32_t length,
    uint32_t now_ms,
    link_deliver deliver,
    void *own)
{
    struct link_header header;
    struct link_entries entries;
    struct link_entry entry;
    bool is_known;
    bool is_new_session;
    if (!link_parse(frame, length, &header, &entries)) {
        return LINK_NO_FRAME;
    }
    if (header.epoch != link->peer_epoch && is_of_before(link, header.epoch) && link_is_up(link, now_ms)) {
        return LINK_OLD_SESSION;
    }
    is_new_session = header.epoch != link->peer_epoch;
    follow_peer(link, header.sender, header.epoch);
    link_hear_signals(link, now_ms);
    if (header.peer_epoch == link->epoch) {
        drop_acknowledged(link, &header);
        if (is_new_session && has_forgotten(link, &header)) {
            restart(link);
        }
    }
    /* numbers of a sender that knows this process, not the one before a restart */
    is_known = header.peer_epoch >> BOOT_SHIFT == link->boot_count && (header.peer_epoch & 0xFFu) == link->address;
    while (deliver != NULL && link_next_entry(&entries, &entry)) {
        if (entry.number == 0u || (is_known && is_new(link, entry.number, now_ms))) {
            deliver(own, &entry);
        }
    }
    return LINK_TAKEN;
}

static uint32_t build(struct hop_link *link, struct link_entry *entry, uint8_t *room, uint32_t size)
{
    struct link_header header;
    uint32_t length;
    if (entry != NULL) {
        entry->head_length =
            link->close == NULL ? 0u : link->close(link->close_own, entry->payload, entry->length, entry->head);
    }
    header.sender = link->address;
    header.epoch = link->epoch;
    header.number = link->frames + 1u;
    header.peer_epoch = link->peer_epoch;
    header.acknowledged = link->received;
    header.mask = link->received_mask;
    length = link_pack(&header, entry, entry == NULL ? 0u : 1u, room, size);
    if (length > 0u) {
        link->frames++;
        link->is_ack_due = false;
    }
    return length;
}

uint32_t link_next_numbered(struct hop_link *link, uint32_t now_ms, uint8_t *room, uint32_t size)
{
    struct link_entry entry;
    struct link_slot *slot;
    uint32_t length;
    uint32_t k;
    if (!link_is_up(link, now_ms)) {
        return 0u;
    }
    for (k = 0u; k < link->count; k++) {
        slot = &link->slots[k];
        if (slot->number == 0u) {
            slot->number = link->next_number;
            slot->send_at_ms = now_ms;
            slot->timeout_ms = FIRST_TIMEOUT_MS;
            link->next_number++;
        }
        if (has_come(slot->send_at_ms, now_ms)) {
            entry.number = slot->number;
            entry.payload = slot->payload;
            entry.length = slot->length;
            length = build(link, &entry, room, size);
            slot->send_at_ms = now_ms + slot->timeout_ms;
            slot->timeout_ms = slot->timeout_ms < LAST_TIMEOUT_MS / 2u ? 2u * slot->timeout_ms : LAST_TIMEOUT_MS;
            return length;
        }
    }
    return 0u;
}

uint32_t link_best_effort(struct hop_link *link, const uint8_t *payload, uint32_t length, uint8_t *room, uint32_t size)
{
    struct link_entry entry;
    entry.number = 0u;
    entry.payload = payload;
    entry.length = length;
    return build(link, &entry, room, size);
}

uint32_t link_acknowledgement(struct hop_link *link, uint32_t now_ms, uint8_t *room, uint32_t size)
{
    return link->is_ack_due && has_come(link->ack_due_ms, now_ms) ? build(link, NULL, room, size) : 0u;
}

uint32_t link_tell(struct hop_link *link, uint8_t *room, uint32_t size)
{
    return build(link, NULL, room, size);
}
