/* What must reach the ground station: kept until its receipt, over a power cut too, and sent again until then.
 *
 * Its node saves before it lets it send, so a number that was sent is never given to another message.
 */
#ifndef BORECHAIN_CHIP_MAIL_H
#define BORECHAIN_CHIP_MAIL_H

#include <stdbool.h>
#include <stdint.h>

#include "hop_link.h"

#define MAIL_ITEMS 8u
#define MAIL_ROOM 244u      /* bytes of a payload; a survey of one IMU has 215 */
#define MAIL_CONTENT 16u    /* bytes of the hash that a receipt names */

struct mail_item {
    int64_t number;
    uint32_t send_at_ms;
    uint32_t wait_ms;
    uint16_t length;        /* 0: free */
    bool is_needed;         /* never dropped for another */
    bool is_settled;        /* receipted; it is free once the link has let go of it */
    uint8_t payload[MAIL_ROOM];
};

/* It is saved as it is; a first start begins with zeros and 1 as the next number. */
struct chip_mail {
    int64_t next_number;
    uint32_t dropped;
    struct mail_item items[MAIL_ITEMS];
};

/* A place for the payload of the number that is next, which then counts as given out; the oldest that may be lost, and
 * is not with the link just now, makes room. NULL where none can. */
struct mail_item *mail_place(struct chip_mail *mail, const struct hop_link *link, bool is_needed);
/* The payload of an item is whole: it is due. Of length 0 the item is given back. */
void mail_keep(struct mail_item *item, uint32_t length, uint32_t now_ms);
/* After a start all is due. */
void mail_resume(struct chip_mail *mail, uint32_t now_ms);
/* Hands what is due to the link. */
void mail_send(struct chip_mail *mail, struct hop_link *link, uint32_t now_ms);
/* False for a receipt of other content, or of nothing that is kept. */
bool mail_receipt(struct chip_mail *mail, int64_t number, const uint8_t *content, uint32_t length);

#endif
