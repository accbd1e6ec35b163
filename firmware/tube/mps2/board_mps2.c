/* A whole tube on QEMU's mps2-an386 (Cortex-M4): joints on two serial lines with SLCAN, the sensor on a third, flash in
 * the memory that the emulator keeps in a file.
 *
 * The sensor's line brings a cycle at a time: a mark, seven 64-bit numbers in the formats of the step (rates, forces,
 * temperature), and the sum of their bytes. Flash: the image, two slots, and a page of the board's own (see BOARD).
 */
#include "chip_node.h"
#include "slcan_line.h"

#include <string.h>

#define REGISTER(place) (*(volatile uint32_t *)(place))
#define UART(line) (0x40004000u + 0x1000u * (line))
#define UART_DATA 0u
#define UART_STATE 4u
#define UART_CONTROL 8u
#define UART_DIVISOR 16u
#define UART_CLEAR 12u
#define UART_RUNS 11u                        /* sends, receives, and asks for the processor at a byte */
#define WAKING REGISTER(0x40001008u)         /* a second timer, which wakes the processor every millisecond */
#define WAKING_CONTROL REGISTER(0x40001000u)
#define WAKING_CLEAR REGISTER(0x4000100Cu)
#define MAY_WAKE REGISTER(0xE000E100u)       /* interrupts that do */
#define PENDING REGISTER(0xE000E280u)
#define WAKERS 0x215u                        /* bytes of three lines, the second timer */
#define TICKS_A_WAKE 25000u
#define TIMER_CONTROL REGISTER(0x40000000u)
#define TIMER_VALUE REGISTER(0x40000004u)
#define TIMER_RELOAD REGISTER(0x40000008u)
#define TICKS_A_US 25u
#define FLASH 0x21000000u
#define IMAGE_SIZE 0x8000u
#define SLOT(which) (FLASH + 0x8000u + 0x4000u * (which))
#define SLOT_SIZE 0x4000u
#define BOARD (FLASH + 0x10000u)             /* tube, whether it has a key, variance of the mount (two words), words of
                                                flash before power fails, a word of nothing, the key of its blocks */
#define KEYS (FLASH + 0x14000u)              /* a page of keys, where joints are sealed */
#define KEYS_SIZE 0x4000u
#define KEYS_MAGIC 0x594B4342u               /* "BCKY" */
#define POWER REGISTER(BOARD + 16u)          /* 0: it does not fail */
#define OPEN_EVERY_MS 500u
#define SENSOR 2u
#define MARK 0xB5u
#define NUMBERS 7u
#define WINDOW_STD (INT64_C(1) << 19)        /* s, Q28: 2 ms, of the window of a reading against its cycle */
#define TRANSFER_SHARE 77                    /* s, Q28, a microsecond: its part 1/sqrt(12), evenly within a transfer */

struct joint {
    struct slcan_line line;
    uint32_t spoken_at_ms;
    bool is_open;
};

struct sensor {
    uint8_t bytes[8u * NUMBERS + 1u];
    uint32_t length;
    int64_t begun_us; /* when the mark came */
    bool is_begun;
};

static struct chip_node node;
static struct joint joints[2];
static struct sensor sensor;
static uint32_t ticks_before, ticks_left;
static int64_t microseconds;
static bool is_known;

static int64_t now_us(void)
{
    const uint32_t value = TIMER_VALUE;
    ticks_left += ticks_before - value;
    ticks_before = value;
    microseconds += ticks_left / TICKS_A_US;
    ticks_left %= TICKS_A_US;
    return microseconds;
}

static uint32_t now_ms(void)
{
    return (uint32_t)((uint64_t)now_us() / 1000u);
}

static void write_bytes(uint32_t line, const uint8_t *bytes, uint32_t length)
{
    while (length > 0u) {
        while ((REGISTER(UART(line) + UART_STATE) & 1u) != 0u) {
        }
        REGISTER(UART(line) + UART_DATA) = *bytes;
        bytes++;
        length--;
    }
}

static bool has_byte(uint32_t line)
{
    return (REGISTER(UART(line) + UART_STATE) & 2u) != 0u;
}

/* Flash */

/* The power fails after so many words, which is for good: nothing is heard or said any more. */
static void spend_power(void)
{
    if (POWER != 0u) {
        POWER = POWER - 1u;
        while (POWER == 0u) {
        }
    }
}

static bool erase(void *own, uint32_t slot)
{
    uint32_t at;
    (void)own;
    for (at = 0u; at < SLOT_SIZE; at += 4u) {
        REGISTER(SLOT(slot) + at) = UINT32_MAX;
    }
    spend_power();
    return true;
}

static bool write_word(void *own, uint32_t slot, uint32_t at, const uint8_t word[SLOT_WORD])
{
    uint32_t halves[2];
    (void)own;
    memcpy(halves, word, sizeof halves);
    REGISTER(SLOT(slot) + at) = halves[0];
    spend_power();
    REGISTER(SLOT(slot) + at + 4u) = halves[1];
    return true;
}

static void read_bytes(void *own, uint32_t slot, uint32_t at, uint8_t *into, uint32_t length)
{
    (void)own;
    memcpy(into, (const uint8_t *)(SLOT(slot) + at), length);
}

/* Joints */

/* Opens the bridge, until it answers; also where it has been silent about a frame. */
static void open_bridge(uint32_t side, uint32_t now)
{
    static const uint8_t order[] = "\r\rC\rO\r";
    if (now - joints[side].spoken_at_ms >= OPEN_EVERY_MS) {
        joints[side].spoken_at_ms = now;
        joints[side].is_open = false;
        chip_end_on_acknowledged(&node.ends[side]);
        write_bytes(side, order, sizeof order - 1u);
    }
}

static void hear_joint(uint32_t side)
{
    struct slcan_frame frame;
    while (has_byte(side)) {
        switch (slcan_take(&joints[side].line, (uint8_t)REGISTER(UART(side) + UART_DATA), &frame)) {
        case SLCAN_FRAME:
            joints[side].is_open = true;
            node_on_frame(&node, (enum node_side)side, frame.identifier, frame.data, frame.length, now_us());
            break;
        case SLCAN_ACKNOWLEDGED:
        case SLCAN_REFUSED:
            chip_end_on_acknowledged(&node.ends[side]);
            break;
        case SLCAN_DONE:
            joints[side].is_open = true;
            break;
        default:
            break;
        }
    }
}

static void speak_at(uint32_t side, uint32_t now)
{
    struct slcan_frame frame;
    uint8_t room[SLCAN_LONGEST];
    if (!joints[side].is_open || node.ends[side].is_in_flight) {
        open_bridge(side, now);
    }
    if (joints[side].is_open) {
        frame.length = chip_end_next_frame(&node.ends[side], &frame.identifier, frame.data, now);
        if (frame.length != CHIP_END_NOTHING) {
            joints[side].spoken_at_ms = now;
            write_bytes(side, room, slcan_write(&frame, true, room));
        }
    }
}

/* The sensor */

/* A cycle ends when its mark comes, not when all of it is here: a line of single bytes takes 5 ms, and 150 where the
 * processor is kept from it. How late the mark itself was then is not known better than that. */
static void take_cycle(void)
{
    int64_t readings[BORECHAIN_IMUS][NODE_READING];
    memset(readings, 0, sizeof readings);
    memcpy(readings[0], sensor.bytes, 8u * NUMBERS);
    readings[0][9] = WINDOW_STD + (now_us() - sensor.begun_us) * TRANSFER_SHARE;
    node_on_readings(&node, readings, sensor.begun_us);
}

static void hear_sensor(void)
{
    uint32_t k, sum = 0u;
    while (has_byte(SENSOR)) {
        const uint8_t byte = (uint8_t)REGISTER(UART(SENSOR) + UART_DATA);
        if (!sensor.is_begun) {
            sensor.is_begun = byte == MARK;
            sensor.begun_us = now_us();
            sensor.length = 0u;
            continue;
        }
        sensor.bytes[sensor.length] = byte;
        sensor.length++;
        if (sensor.length == sizeof sensor.bytes) {
            sensor.is_begun = false;
            for (k = 0u; k < 8u * NUMBERS; k++) {
                sum += sensor.bytes[k];
            }
            if ((sum & 0xFFu) == byte) {
                take_cycle();
            }
            return;
        }
    }
}

/* Until a byte has come or a millisecond has gone. */
static void sleep_a_while(void)
{
    uint32_t line;
    if (has_byte(0u) || has_byte(1u) || has_byte(SENSOR)) {
        return;
    }
    __asm__ volatile("wfi");
    WAKING_CLEAR = 1u;
    for (line = 0u; line < 3u; line++) {
        REGISTER(UART(line) + UART_CLEAR) = 2u;
    }
    PENDING = WAKERS;
}

static void begin_board(void)
{
    uint32_t line;
    for (line = 0u; line < 3u; line++) {
        REGISTER(UART(line) + UART_DIVISOR) = 16u;
        REGISTER(UART(line) + UART_CONTROL) = UART_RUNS;
    }
    __asm__ volatile("cpsid i"); /* interrupts end a sleep and are not taken */
    WAKING = TICKS_A_WAKE;
    WAKING_CONTROL = 9u;
    MAY_WAKE = WAKERS;
    TIMER_RELOAD = UINT32_MAX;
    TIMER_VALUE = UINT32_MAX;
    TIMER_CONTROL = 1u;
    ticks_before = UINT32_MAX;
    microseconds = 1000000;
}

int main(void)
{
    static const struct slot_board flash = {NULL, SLOT_SIZE, erase, write_word, read_bytes};
    struct node_identity identity;
    uint32_t side;
    begin_board();
    identity.tube = (uint8_t)REGISTER(BOARD);
    identity.block_key = REGISTER(BOARD + 4u) != 0u ? (const uint8_t *)(BOARD + 24u) : NULL;
    identity.key_page = REGISTER(KEYS) == KEYS_MAGIC ? (const uint8_t *)KEYS : NULL;
    identity.key_page_size = KEYS_SIZE;
    memcpy(&identity.mount_var, (const uint8_t *)(BOARD + 8u), sizeof identity.mount_var);
    is_known = node_begin(&node, (const uint8_t *)FLASH, IMAGE_SIZE, &identity, &flash, 0xB0CE0000u, now_us());
    while (is_known) {
        for (side = 0u; side < 2u; side++) {
            hear_joint(side);
        }
        hear_sensor();
        node_advance(&node, now_us());
        for (side = 0u; side < 2u; side++) {
            speak_at(side, now_ms());
        }
        sleep_a_while();
    }
    for (;;) {
    }
}
