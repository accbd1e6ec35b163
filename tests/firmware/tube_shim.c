/* The small program of a chip on this machine: its registers are memory, its end of the joint notes what it is told. */
#include <stdint.h>
#include <string.h>

uint32_t *shim_register(uint32_t place);
#define main chip_main
#include "chip_tube_in_memory.c"
#undef main

struct shim {
    uint8_t in[512], out[512], said[64], sent[64];
    uint32_t in_length, in_at, out_length, timer, boots, identifier, said_length, said_count, topic;
    uint32_t acknowledged, heard_at, heard_length, heard_identifier, sent_length, sent_slot, next_length, held;
};
struct shim shim;

uint32_t *shim_register(uint32_t place)
{
    static uint32_t state, word, other;
    switch (place) {
    case 0x40004000u: /* what is read stands in the word; what was written before is taken by shim_flush */
        if (shim.in_at < shim.in_length) {
            word = shim.in[shim.in_at++];
            return &word;
        }
        shim.out_length++;
        return &((uint32_t *)(void *)shim.out)[(shim.out_length - 1u) % 128u];
    case 0x40004004u:
        state = shim.in_at < shim.in_length ? 2u : 0u;
        return &state;
    case 0x40000004u:
        return &shim.timer;
    case 0x21000000u:
        return &shim.boots;
    default:
        return &other;
    }
}

void chip_end_begin(
    struct chip_end *e, const struct chip_end_calls *c, uint8_t a, uint32_t b, uint8_t l, uint32_t n, uint32_t t)
{
    (void)e; (void)c; (void)a; (void)b; (void)l; (void)n; (void)t;
}

void chip_end_say(struct chip_end *e, uint32_t identifier, uint8_t topic, const uint8_t *data, uint8_t length)
{
    (void)e;
    shim.identifier = identifier;
    shim.topic = topic;
    shim.said_length = length;
    shim.said_count++;
    memcpy(shim.said, data, length);
}

void chip_end_on_frame(struct chip_end *e, uint32_t identifier, const uint8_t *data, uint8_t length, uint32_t now)
{
    (void)e; (void)data;
    shim.heard_identifier = identifier;
    shim.heard_length = length;
    shim.heard_at = now;
}

void chip_end_on_acknowledged(struct chip_end *e)
{
    (void)e;
    shim.acknowledged++;
}

uint8_t chip_end_next_frame(struct chip_end *e, uint32_t *identifier, uint8_t data[ISOTP_FD], uint32_t now)
{
    (void)e; (void)now;
    *identifier = 0x04202000u;
    memset(data, 0x5a, shim.next_length == CHIP_END_NOTHING ? 0u : shim.next_length);
    return (uint8_t)shim.next_length;
}

bool link_holds(const struct hop_link *l, const uint8_t *payload)
{
    uint32_t k = (uint32_t)((payload - echoes[0]) / (long)sizeof echoes[0]);
    (void)l;
    return (shim.held >> k & 1u) != 0u;
}

bool link_send(struct hop_link *l, const uint8_t *payload, uint32_t length)
{
    (void)l;
    shim.sent_slot = (uint32_t)((payload - echoes[0]) / (long)sizeof echoes[0]);
    shim.sent_length = length;
    memcpy(shim.sent, payload, length < sizeof shim.sent ? length : sizeof shim.sent);
    return true;
}

struct shim *shim_state(void) { return &shim; }
uint32_t shim_now(uint32_t timer) { shim.timer = timer; return now_ms(); }
void shim_begin(void)
{
    memset(&shim, 0, sizeof shim);
    memset(&end, 0, sizeof end);
    memset(&line, 0, sizeof line);
    shim.next_length = CHIP_END_NOTHING;
    shim.timer = ticks_before = UINT32_MAX;
    ticks_left = milliseconds = spoken_at_ms = 0u;
    is_open = false;
}
void shim_payload(const uint8_t *payload, uint32_t length) { on_payload(NULL, payload, length); }
void shim_aiding(int type, uint32_t yaw, int32_t offset, int32_t hops)
{
    union native_message heard;
    memset(&heard, 0, sizeof heard);
    heard.aiding.valid_at = 123456;
    heard.aiding.hops = (int16_t)hops;
    heard.aiding.yaw = yaw;
    heard.aiding.offset = offset;
    heard.aiding.epoch = 4u;
    heard.aiding.yaw_var = 50u;
    heard.aiding.systematic_var = 60u;
    on_signals(NULL, type, &heard);
}
void shim_hello(uint32_t boots) { shim.boots = boots; say_hello(); }
int shim_open(uint32_t now) { open_bridge(now); return is_open; }
int shim_hear(void) { hear(); return is_open; }
void shim_speak(uint32_t now) { speak(now); }
uint32_t shim_spoken(void) { return spoken_at_ms; }
int shim_is_open(int now) { is_open = now != 0; return is_open; }
int shim_unpack_state(int64_t numbers[9])
{
    struct borechain_native_node_state state;
    const int said = borechain_native_unpack_node_state(shim.said, shim.said_length, &state);
    const int64_t found[9] = {state.tube, state.at, state.hops, state.mode, state.yaw, state.yaw_var,
                              state.systematic_var, state.epoch, shim.topic};
    memcpy(numbers, found, sizeof found);
    return said;
}
int shim_unpack_hello(int64_t numbers[5])
{
    struct borechain_native_hello hello;
    const int said = borechain_native_unpack_hello(shim.said, shim.said_length, &hello);
    const int64_t found[5] = {hello.tube, hello.boot_count, hello.hops, hello.mode, hello.link_quality};
    memcpy(numbers, found, sizeof found);
    return said;
}
void shim_frames(uint32_t frames) { end.link.frames = frames; }
