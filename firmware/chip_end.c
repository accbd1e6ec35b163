/* One end of a joint on a chip, see chip_end.h. */
#include "chip_end.h"

#include <string.h>

#define PRESENCE 29u
#define FLOW_CONTROL 30u
#define TUNNEL 31u
#define EVERYBODY 255u
#define PRESENCE_EVERY_MS 250u
#define HEADER_EVERY_MS 2000u
#define HELLO_PRIORITY 2u
#define COMMAND_PRIORITY 3u
#define SURVEY_PRIORITY 4u
#define SEAL_TAG 8u
#define CONSECUTIVE 2u /* type of a frame of ISO-TP */

static uint32_t identifier_of(const struct chip_end *end, uint32_t priority, uint32_t type, uint32_t part)
{
    return priority << 26 | type << 21 | (uint32_t)end->address << 13 | EVERYBODY << 5 | part;
}

void chip_end_begin(
    struct chip_end *end,
    const struct chip_end_calls *calls,
    uint8_t address,
    uint32_t boot_count,
    uint8_t largest,
    uint32_t nonce,
    uint32_t now_ms)
{
    memset(end, 0, sizeof *end);
    end->calls = *calls;
    end->address = address;
    end->largest = largest;
    end->nonce = nonce;
    end->begun_ms = now_ms;
    end->shown_at_ms = now_ms - PRESENCE_EVERY_MS;
    end->told_at_ms = now_ms - HEADER_EVERY_MS;
    link_begin(&end->link, address, boot_count);
    end->link.close = calls->close_payload;
    end->link.close_own = calls->own;
    if (calls->seal == NULL) {
        (void)isotp_listen(&end->receivers[0], end->urgent, CHIP_END_URGENT);
    } else { /* no signals wait where all is sealed, and what is urgent is longer */
        (void)isotp_listen(&end->receivers[0], (uint8_t *)end->signals, sizeof end->signals);
    }
    (void)isotp_listen(&end->receivers[1], end->incoming, CHIP_END_ROOM);
}

/* The place of a message: of the same topic, or a free one, or that of the least urgent. */
static struct chip_end_signals *place_of(struct chip_end *end, uint32_t identifier, uint8_t topic)
{
    struct chip_end_signals *least = &end->signals[0], *found = NULL;
    uint32_t k;
    for (k = 0u; k < CHIP_END_WAITING; k++) {
        struct chip_end_signals *const one = &end->signals[k];
        if (one->length > 0u && one->identifier == identifier && one->topic == topic) {
            return one;
        }
        if (one->length == 0u) {
            found = one;
        } else if (one->identifier > least->identifier) {
            least = one;
        }
    }
    return found != NULL ? found : least->identifier > identifier ? least : NULL;
}

void chip_end_say(
    struct chip_end *end,
    uint32_t identifier,
    uint8_t topic,
    const uint8_t *data,
    uint8_t length)
{
    const uint32_t own = identifier | (uint32_t)end->address << 13;
    struct chip_end_signals *const place = length > CHIP_END_SIGNALS ? NULL : place_of(end, own, topic);
    if (place != NULL) {
        place->identifier = own;
        place->topic = topic;
        place->length = length;
        memcpy(place->data, data, length);
    }
}

/* The most urgent of the signals that wait; 0 where none do. */
static uint8_t next_signals(struct chip_end *end, uint32_t *identifier, uint8_t *data)
{
    struct chip_end_signals *first = NULL;
    uint8_t length;
    uint32_t k;
    for (k = 0u; k < CHIP_END_WAITING; k++) {
        struct chip_end_signals *const one = &end->signals[k];
        if (one->length > 0u && (first == NULL || one->identifier < first->identifier)) {
            first = one;
        }
    }
    if (first == NULL) {
        return 0u;
    }
    length = first->length;
    first->length = 0u;
    *identifier = first->identifier;
    memcpy(data, first->data, length);
    return length;
}

static void deliver(void *own, const struct link_entry *entry)
{
    const struct chip_end *end = own;
    end->calls.on_payload(end->calls.own, entry->payload, entry->length);
}

/* A frame of the link, which may be in a seal. */
static bool take_frame(struct chip_end *end, const uint8_t *frame, uint32_t length, uint32_t now_ms)
{
    const bool has_room = end->calls.has_room == NULL || end->calls.has_room(end->calls.own);
    if (end->calls.seal != NULL) {
        length = end->calls.seal->open(end->calls.joint, frame, length, now_ms);
        if (length == 0u) {
            return true; /* the seal has counted it, or it was for the seal alone */
        }
        frame += CHIP_END_SEAL_HEAD;
    }
    return link_receive(&end->link, frame, length, now_ms, has_room ? deliver : NULL, end) == LINK_TAKEN;
}

/* A payload at a time: one that a more urgent one interrupts comes again by the link. */
static void on_tunnel(struct chip_end *end, uint32_t priority, const uint8_t *data, uint8_t length, uint32_t now_ms)
{
    const uint32_t which = priority < COMMAND_PRIORITY ? 0u : 1u;
    struct isotp_receiver *receiver = &end->receivers[which];
    enum isotp_answer answer;
    if (length > 0u && data[0] >> 4 == CONSECUTIVE && end->priorities[which] != priority) {
        end->wrong++;
        return;
    }
    end->priorities[which] = (uint8_t)priority;
    answer = isotp_on_frame(receiver, data, length, now_ms);
    if (answer == ISOTP_WHOLE) {
        end->wrong += take_frame(end, receiver->room, receiver->length, now_ms) ? 0u : 1u;
    } else if (answer != ISOTP_NOTHING) {
        end->wrong++;
    }
}

void chip_end_on_frame(struct chip_end *end, uint32_t identifier, const uint8_t *data, uint8_t length, uint32_t now_ms)
{
    const uint32_t type = identifier >> 21 & 0x1Fu;
    union native_message heard;
    int answer;
    if ((identifier >> 13 & 0xFFu) == end->address || type == PRESENCE) {
        return;
    }
    if (type == TUNNEL) {
        on_tunnel(end, identifier >> 26, data, length, now_ms);
    } else if (type == FLOW_CONTROL) {
        end->wrong += isotp_on_flow(&end->sender, data, length, now_ms) != ISOTP_NOTHING;
    } else if (end->calls.seal != NULL) {
        (void)end->calls.seal->open(end->calls.joint, NULL, 0u, now_ms); /* signals have no seal */
    } else {
        answer = native_hear(&end->native, identifier, data, length, &heard);
        end->wrong += answer < 0;
        if (answer > 0) {
            link_hear_signals(&end->link, now_ms);
            end->calls.on_signals(end->calls.own, answer, &heard);
        }
    }
}

void chip_end_on_acknowledged(struct chip_end *end)
{
    end->is_in_flight = false;
}

static uint8_t next_presence(struct chip_end *end, uint32_t *identifier, uint8_t *data, uint32_t now_ms)
{
    const uint32_t age = now_ms - end->begun_ms;
    uint32_t k;
    for (k = 0u; k < 4u; k++) {
        data[k] = (uint8_t)(age >> (24u - 8u * k) & 0xFFu);
        data[4u + k] = (uint8_t)(end->nonce >> (24u - 8u * k) & 0xFFu);
    }
    end->shown_at_ms = now_ms;
    *identifier = identifier_of(end, HELLO_PRIORITY, PRESENCE, end->nonce & 0x1Fu);
    return 8u;
}

/* The next frame of the link, if one is due, into a room. */
static uint32_t next_of_link(struct chip_end *end, uint8_t *room, uint32_t size, uint32_t now_ms)
{
    uint8_t word[CHIP_END_WORD];
    uint32_t length = end->calls.next_word == NULL ? 0u : end->calls.next_word(end->calls.own, word, sizeof word);
    if (length > 0u) {
        return link_best_effort(&end->link, word, length, room, size);
    }
    length = link_next_numbered(&end->link, now_ms, room, size);
    if (length == 0u) {
        length = link_acknowledgement(&end->link, now_ms, room, size);
    }
    if (length == 0u && now_ms - end->told_at_ms >= HEADER_EVERY_MS) {
        length = link_tell(&end->link, room, size);
    }
    return length;
}

/* The same in its seal, or what that has to say; nothing of the link goes before its session is proven. */
static uint32_t next_sealed(struct chip_end *end, uint32_t now_ms)
{
    const struct chip_end_seal *const seal = end->calls.seal;
    uint32_t length = seal->own_frame(end->calls.joint, end->outgoing, CHIP_END_ROOM, now_ms);
    if (length > 0u || !seal->is_proven(end->calls.joint)) {
        return length;
    }
    length = next_of_link(
        end, &end->outgoing[CHIP_END_SEAL_HEAD], CHIP_END_ROOM - CHIP_END_SEAL_HEAD - SEAL_TAG, now_ms);
    if (length > 0u) {
        end->told_at_ms = now_ms;
        length = seal->close(end->calls.joint, end->outgoing, length, CHIP_END_ROOM);
    }
    return length;
}

static void begin_next(struct chip_end *end, uint32_t now_ms)
{
    uint32_t length;
    if (end->calls.seal != NULL) {
        length = next_sealed(end, now_ms);
    } else {
        length = next_of_link(end, end->outgoing, CHIP_END_ROOM, now_ms);
        end->told_at_ms = length > 0u ? now_ms : end->told_at_ms;
    }
    if (length > 0u) {
        isotp_begin(&end->sender, end->outgoing, length, end->largest, now_ms);
    }
}

static uint8_t choose(struct chip_end *end, uint32_t *identifier, uint8_t data[ISOTP_FD], uint32_t now_ms)
{
    uint32_t which;
    uint8_t length;
    if (now_ms - end->shown_at_ms >= PRESENCE_EVERY_MS) {
        return next_presence(end, identifier, data, now_ms);
    }
    for (which = 0u; which < 2u; which++) {
        if (end->receivers[which].has_flow) {
            end->receivers[which].has_flow = false;
            memcpy(data, end->receivers[which].flow, ISOTP_FLOW_LENGTH);
            *identifier = identifier_of(end, end->priorities[which], FLOW_CONTROL, 0u);
            return ISOTP_FLOW_LENGTH;
        }
    }
    length = end->calls.seal != NULL ? 0u : next_signals(end, identifier, data);
    if (length > 0u) {
        return length;
    }
    if (!end->sender.is_open) {
        begin_next(end, now_ms);
    }
    length = isotp_next_frame(&end->sender, data, now_ms);
    *identifier = identifier_of(end, SURVEY_PRIORITY, TUNNEL, 0u);
    return length > 0u ? length : CHIP_END_NOTHING;
}

uint8_t chip_end_next_frame(struct chip_end *end, uint32_t *identifier, uint8_t data[ISOTP_FD], uint32_t now_ms)
{
    uint8_t length;
    end->wrong += isotp_advance_sender(&end->sender, now_ms) != ISOTP_NOTHING;
    end->wrong += isotp_advance_receiver(&end->receivers[0], now_ms) != ISOTP_NOTHING;
    end->wrong += isotp_advance_receiver(&end->receivers[1], now_ms) != ISOTP_NOTHING;
    if (end->is_in_flight) {
        return CHIP_END_NOTHING;
    }
    length = choose(end, identifier, data, now_ms);
    end->is_in_flight = length != CHIP_END_NOTHING;
    return length;
}
