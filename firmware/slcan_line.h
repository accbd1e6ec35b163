/* SLCAN as a chip speaks it to its adapter on a serial line: frames of 29 bits both ways, as a pure state machine. */
#ifndef BORECHAIN_SLCAN_LINE_H
#define BORECHAIN_SLCAN_LINE_H

#include <stdbool.h>
#include <stdint.h>

#define SLCAN_LONGEST 139u /* bytes of a line, its end included */

struct slcan_frame {
    uint32_t identifier;
    uint8_t length;
    uint8_t data[64];
};

enum slcan_event {
    SLCAN_NOTHING = 0,      /* the line goes on */
    SLCAN_FRAME = 1,        /* a frame came from the bus */
    SLCAN_ACKNOWLEDGED = 2, /* the frame that was handed over has been acknowledged there */
    SLCAN_DONE = 3,         /* an order was obeyed */
    SLCAN_REFUSED = -1,     /* it was not: a bell */
    SLCAN_GARBAGE = -2      /* the line is none */
};

/* It begins as zeros. */
struct slcan_line {
    uint8_t line[SLCAN_LONGEST];
    uint8_t length;
    bool is_overlong;
};

enum slcan_event slcan_take(struct slcan_line *line, uint8_t byte, struct slcan_frame *frame);
/* Bytes of the order that hands a frame over; 0 where no frame has this length. */
uint32_t slcan_write(const struct slcan_frame *frame, bool is_fd, uint8_t room[SLCAN_LONGEST]);

#endif
