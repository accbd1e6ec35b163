/* A chip at the end of a joint, on QEMU's mps2-an386 (Cortex-M4): its serial line goes to `borechain link chip`.
 *
 * It says hello, answers each aiding with a node state, and sends back what reaches it by the link. The step is not in
 * it yet: the yaw of its states is that of the aiding, with the offset of the joints.
 */
#include "chip_end.h"
#include "slcan_line.h"

#include <string.h>

#define REGISTER(place) (*(volatile uint32_t *)(place))
#define UART_DATA REGISTER(0x40004000u)
#define UART_STATE REGISTER(0x40004004u)
#define UART_CONTROL REGISTER(0x40004008u)
#define UART_DIVISOR REGISTER(0x40004010u)
#define TIMER_CONTROL REGISTER(0x40000000u)
#define TIMER_VALUE REGISTER(0x40000004u)
#define TIMER_RELOAD REGISTER(0x40000008u)
#define BOOT_COUNT REGISTER(0x21000000u) /* a place that lasts, which the emulator is given */
#define TICKS_A_MS 25000u
#define TUBE 2u
#define HELLO_EVERY_MS 1000u
#define OPEN_EVERY_MS 500u
#define TURN 0xFFFFFFu
#define TRACKING 3u
#define STILL 4u

static struct chip_end end;
static struct slcan_line line;
static uint8_t echoes[LINK_SLOTS][400];
static uint32_t ticks_before, ticks_left, milliseconds, spoken_at_ms;
static bool is_open;

static uint32_t now_ms(void)
{
    const uint32_t value = TIMER_VALUE;
    ticks_left += ticks_before - value;
    ticks_before = value;
    milliseconds += ticks_left / TICKS_A_MS;
    ticks_left %= TICKS_A_MS;
    return milliseconds;
}

static void write_bytes(const uint8_t *bytes, uint32_t length)
{
    while (length > 0u) {
        while ((UART_STATE & 1u) != 0u) {
        }
        UART_DATA = *bytes;
        bytes++;
        length--;
    }
}

/* What has come is sent back by the link. */
static void on_payload(void *own, const uint8_t *payload, uint32_t length)
{
    uint32_t k;
    (void)own;
    for (k = 0u; k < LINK_SLOTS; k++) {
        if (length <= sizeof echoes[k] && !link_holds(&end.link, echoes[k])) {
            memcpy(echoes[k], payload, length);
            (void)link_send(&end.link, echoes[k], length);
            return;
        }
    }
}

static void on_signals(void *own, int type, const union native_message *heard)
{
    struct borechain_native_node_state state;
    uint8_t data[BORECHAIN_NATIVE_NODE_STATE_LENGTH];
    (void)own;
    if (type != BORECHAIN_NATIVE_AIDING_TYPE) {
        return;
    }
    memset(&state, 0, sizeof state);
    state.tube = TUBE;
    state.at = heard->aiding.valid_at;
    state.hops = (int16_t)(heard->aiding.hops + 1);
    state.mode = TRACKING;
    state.yaw = (heard->aiding.yaw + (uint32_t)heard->aiding.offset) & TURN;
    state.yaw_var = heard->aiding.yaw_var;
    state.systematic_var = heard->aiding.systematic_var;
    state.epoch = heard->aiding.epoch;
    if (borechain_native_pack_node_state(&state, (uint8_t)end.link.frames, data) == BORECHAIN_NATIVE_TAKEN) {
        chip_end_say(&end, BORECHAIN_NATIVE_NODE_STATE_IDENTIFIER, TUBE, data, sizeof data);
    }
}

static void say_hello(void)
{
    const struct borechain_native_hello hello = {TUBE, BOOT_COUNT, -1, STILL, 100u};
    uint8_t data[BORECHAIN_NATIVE_HELLO_LENGTH];
    if (borechain_native_pack_hello(&hello, (uint8_t)end.link.frames, data) == BORECHAIN_NATIVE_TAKEN) {
        chip_end_say(&end, BORECHAIN_NATIVE_HELLO_IDENTIFIER, 0u, data, sizeof data);
    }
}

/* Opens the bridge, until it answers; also where it has been silent about a frame. */
static void open_bridge(uint32_t now)
{
    static const uint8_t order[] = "\r\rC\rO\r";
    if (now - spoken_at_ms >= OPEN_EVERY_MS) {
        spoken_at_ms = now;
        is_open = false;
        chip_end_on_acknowledged(&end);
        write_bytes(order, sizeof order - 1u);
    }
}

static void hear(void)
{
    struct slcan_frame frame;
    while ((UART_STATE & 2u) != 0u) {
        switch (slcan_take(&line, (uint8_t)UART_DATA, &frame)) {
        case SLCAN_FRAME:
            is_open = true;
            chip_end_on_frame(&end, frame.identifier, frame.data, frame.length, now_ms());
            break;
        case SLCAN_ACKNOWLEDGED:
        case SLCAN_REFUSED:
            chip_end_on_acknowledged(&end);
            break;
        case SLCAN_DONE:
            is_open = true;
            break;
        default:
            break;
        }
    }
}

static void speak(uint32_t now)
{
    struct slcan_frame frame;
    uint8_t room[SLCAN_LONGEST];
    frame.length = chip_end_next_frame(&end, &frame.identifier, frame.data, now);
    if (frame.length != CHIP_END_NOTHING) {
        spoken_at_ms = now;
        write_bytes(room, slcan_write(&frame, true, room));
    }
}

int main(void)
{
    const struct chip_end_calls calls = {NULL, on_payload, on_signals, NULL, NULL, NULL, NULL, NULL};
    uint32_t hello_at_ms = 0u;
    UART_DIVISOR = 16u;
    UART_CONTROL = 3u;
    TIMER_RELOAD = UINT32_MAX;
    TIMER_VALUE = UINT32_MAX;
    TIMER_CONTROL = 1u;
    ticks_before = UINT32_MAX;
    chip_end_begin(&end, &calls, TUBE, BOOT_COUNT, ISOTP_FD, 0xB0CE0000u + BOOT_COUNT, 0u);
    for (;;) {
        uint32_t now;
        hear();
        now = now_ms();
        if (!is_open || end.is_in_flight) {
            open_bridge(now);
        }
        if (now - hello_at_ms >= HELLO_EVERY_MS) {
            hello_at_ms = now;
            say_hello();
        }
        if (is_open) {
            speak(now);
        }
    }
}
