/* What must reach the ground station, see chip_mail.h. */
#include "chip_mail.h"

#include <stddef.h>
#include <string.h>

#include "blake2b.h"

#define FIRST_WAIT_MS 10000u
#define LAST_WAIT_MS 60000u

static struct mail_item *free_place(struct chip_mail *mail, const struct hop_link *link)
{
    struct mail_item *oldest = NULL;
    uint32_t k;
    for (k = 0u; k < MAIL_ITEMS; k++) {
        struct mail_item *const one = &mail->items[k];
        if (one->length == 0u) {
            return one;
        }
        if (link_holds(link, one->payload)) {
            continue;
        }
        if (one->is_settled) {
            return one;
        }
        if (oldest == NULL || (oldest->is_needed && !one->is_needed) ||
            (oldest->is_needed == one->is_needed && one->number < oldest->number)) {
            oldest = one;
        }
    }
    mail->dropped++;
    return oldest;
}

struct mail_item *mail_place(struct chip_mail *mail, const struct hop_link *link, bool is_needed)
{
    struct mail_item *const place = free_place(mail, link);
    if (place == NULL) {
        return NULL;
    }
    place->is_settled = false;
    place->number = mail->next_number;
    place->is_needed = is_needed;
    place->length = 0u;
    mail->next_number++;
    return place;
}

void mail_keep(struct mail_item *item, uint32_t length, uint32_t now_ms)
{
    item->length = (uint16_t)length;
    item->send_at_ms = now_ms;
    item->wait_ms = FIRST_WAIT_MS;
}

void mail_resume(struct chip_mail *mail, uint32_t now_ms)
{
    uint32_t k;
    for (k = 0u; k < MAIL_ITEMS; k++) {
        if (mail->items[k].is_settled) {
            mail->items[k].length = 0u;
        }
        mail->items[k].send_at_ms = now_ms;
        mail->items[k].wait_ms = FIRST_WAIT_MS;
    }
}

void mail_send(struct chip_mail *mail, struct hop_link *link, uint32_t now_ms)
{
    uint32_t k;
    for (k = 0u; k < MAIL_ITEMS; k++) {
        struct mail_item *const one = &mail->items[k];
        if (one->length == 0u || link_holds(link, one->payload)) {
            continue;
        }
        if (one->is_settled) {
            one->length = 0u;
            continue;
        }
        if ((int32_t)(now_ms - one->send_at_ms) < 0) {
            continue;
        }
        if (link_send(link, one->payload, one->length)) {
            one->send_at_ms = now_ms + one->wait_ms;
            one->wait_ms = one->wait_ms < LAST_WAIT_MS / 2u ? 2u * one->wait_ms : LAST_WAIT_MS;
        }
    }
}

bool mail_receipt(struct chip_mail *mail, int64_t number, const uint8_t *content, uint32_t length)
{
    uint8_t own[MAIL_CONTENT];
    uint32_t k;
    for (k = 0u; k < MAIL_ITEMS; k++) {
        struct mail_item *const one = &mail->items[k];
        if (one->length > 0u && one->number == number) {
            blake2b_hash(one->payload, one->length, own, MAIL_CONTENT);
            if (length != MAIL_CONTENT || memcmp(own, content, MAIL_CONTENT) != 0) {
                return false;
            }
            one->is_settled = true;
            return true;
        }
    }
    return false;
}
