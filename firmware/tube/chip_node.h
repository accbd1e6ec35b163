/* A tube's node on a chip: the step, its clock, what it hears and says at both of its joints, and what it keeps.
 *
 * The node is told of time, readings, signals and payloads, and asked by nothing: what it has to say goes to its two
 * ends. What it keeps over a power cut lies in one piece of memory (`chip_kept`, then the record up to what a start
 * clears), so a save needs no room beside it.
 */
#ifndef BORECHAIN_CHIP_NODE_H
#define BORECHAIN_CHIP_NODE_H

#include "borechain_step.h"
#include "chip_block.h"
#include "chip_clock.h"
#include "chip_end.h"
#include "chip_mail.h"
#include "chip_said.h"
#include "chip_seals.h"
#include "chip_words.h"
#include "two_slots.h"

#define NODE_RELAYS 4u      /* payloads of others that wait for their next hop */
#define NODE_RELAY_ROOM 416u
#define NODE_ANSWERS 4u     /* orders that are remembered, so that none is obeyed twice */
#define NODE_REPLY_ROOM 96u
#define NODE_READING 20u    /* numbers of a reading, of the step */

enum node_side { NODE_UPPER = 0, NODE_LOWER = 1 };

/* What the step's settings do not hold. */
struct node_identity {
    int64_t mount_var;   /* rad^2, Q56, of the IMU against the tube's marks */
    const uint8_t *block_key; /* BLOCK_KEY_SIZE bytes, of who may change its parameters; NULL: nobody */
    const uint8_t *key_page;  /* keys of seals, see key_page.h; NULL: everybody is believed */
    uint32_t key_page_size;
    uint8_t tube;
};

struct node_answer {
    int64_t order;
    uint8_t room[NODE_REPLY_ROOM];
    uint8_t length;
};

/* Kept over a power cut, with the record behind it. */
struct chip_kept {
    char source[16];     /* digest of the step, whose records these are */
    uint32_t boots;
    int32_t hops;
    struct chip_mail mail;
    struct node_answer answers[NODE_ANSWERS];
    uint32_t next_answer;
    struct block_kept block;
    struct borechain_parameters corrections[1 + BORECHAIN_IMUS]; /* the block's, then each IMU's own, of the image */
};

struct node_relay {
    uint16_t length;
    uint8_t side;        /* of the link that has it */
    bool is_state;       /* it may be lost, and waits until it leaves */
    uint8_t payload[NODE_RELAY_ROOM];
};

/* The newest survey, to say it again by its time. */
struct node_surveyed {
    int64_t rig_at;
    int64_t settle_time;
    int32_t hops;
    uint16_t flags;
    bool is_said;
};

struct chip_node {
    struct chip_kept kept;
    struct borechain_node record; /* up to `cycles` it is kept too */
    struct borechain_settings settings;
    struct node_identity identity;
    struct chip_clock clock;
    struct chip_end ends[2];
    struct node_relay relays[NODE_RELAYS];
    struct node_surveyed surveyed;
    struct block_update update;
    struct chip_seals seals;
    struct chip_said said;
    struct slot_found found;
    const struct slot_board *flash;
    int64_t now_us;
    int64_t cycle_us;    /* end of the cycle before */
    int64_t worth;       /* s, Q28, of the saved yaw; negative: it started as new */
    uint32_t hello_at_ms;
    uint32_t ask_at_ms;
    uint32_t saved_at_ms;
    uint32_t refused;    /* saves that the flash did not take */
    uint8_t neighbours[2]; /* addresses, 0 where none was heard since the link came up */
    bool has_neighbour[2];
    bool is_told_hops;
    bool is_announced;
    bool save_is_due;
};

/* From the image in its page of flash and from what was saved; false where the image is none of this program, or a page of
 * keys is not this tube's. */
bool node_begin(
    struct chip_node *node,
    const uint8_t *image,
    uint32_t image_size,
    const struct node_identity *identity,
    const struct slot_board *flash,
    uint32_t nonce,
    int64_t now_us);
/* A cycle ended at a time that may have passed: one row an IMU, in the formats of the step. */
void node_on_readings(struct chip_node *node, int64_t readings[BORECHAIN_IMUS][NODE_READING], int64_t ended_us);
void node_on_frame(
    struct chip_node *node,
    enum node_side side,
    uint32_t identifier,
    const uint8_t *data,
    uint8_t length,
    int64_t now_us);
/* What no frame brings: hello, the clock's questions, mail. */
void node_advance(struct chip_node *node, int64_t now_us);

/* For the node's parts: */
uint32_t node_ms(int64_t us);
/* us^2, of rig time, held at what stands for unknown. */
int64_t node_clock_var(const struct chip_node *node);
/* A place of the mail, of which it is to be filled at once; NULL where none can be had. */
struct mail_item *node_mail_place(struct chip_node *node, bool is_needed);
/* Where and when something is said under a number. */
struct word_origin node_origin(const struct chip_node *node, int64_t number);
/* A place of the mail was filled: it goes after the next save. */
void node_keep(struct chip_node *node, struct mail_item *item, uint32_t length);

#endif
