/* A link for the tests of a chip's mail: it takes and holds what it is told to. */
#include <string.h>

#include "chip_mail.h"

static struct chip_mail mail;
static struct hop_link link;
static unsigned held;  /* bit k: it has the payload of item k */
static unsigned taken; /* likewise: since the last look it was given */
static unsigned room;  /* payloads that it takes yet */

static unsigned item_of(const uint8_t *payload)
{
    unsigned k = 0u;
    while (mail.items[k].payload != payload) {
        k++;
    }
    return k;
}

bool link_holds(const struct hop_link *own, const uint8_t *payload)
{
    (void)own;
    return (held >> item_of(payload) & 1u) != 0u;
}

bool link_send(struct hop_link *own, const uint8_t *payload, uint32_t length)
{
    (void)own;
    if (room == 0u || length == 0u) {
        return false;
    }
    room--;
    taken |= 1u << item_of(payload);
    return true;
}

void shim_begin(void)
{
    memset(&mail, 0, sizeof mail);
    mail.next_number = 1;
    held = taken = 0u;
    room = 1000u;
}

/* Item that a payload was placed in, -1 where there is no place. */
int shim_place(int is_needed, const uint8_t *payload, uint32_t length, uint32_t now_ms)
{
    struct mail_item *const place = mail_place(&mail, &link, is_needed != 0);
    if (place == NULL) {
        return -1;
    }
    if (length > 0u) {
        memcpy(place->payload, payload, length);
    }
    mail_keep(place, length, now_ms);
    return (int)(place - mail.items);
}

/* Items that were given to the link now, bit by bit. */
unsigned shim_send(uint32_t now_ms)
{
    taken = 0u;
    mail_send(&mail, &link, now_ms);
    return taken;
}

int shim_receipt(int64_t number, const uint8_t *content, uint32_t length)
{
    return mail_receipt(&mail, number, content, length);
}

void shim_resume(uint32_t now_ms)
{
    mail_resume(&mail, now_ms);
}

void shim_link(unsigned now_held, unsigned takes)
{
    held = now_held;
    room = takes;
}

int64_t shim_number(unsigned item)
{
    return mail.items[item].length > 0u ? mail.items[item].number : 0;
}

int64_t shim_next(void)
{
    return mail.next_number;
}

uint32_t shim_dropped(void)
{
    return mail.dropped;
}
