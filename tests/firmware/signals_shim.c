/* One node whose numbers the tests set by name, and what its signals make of them. */
#include <string.h>

#include "node_signals.h"

static struct chip_node node;

#define PLACES(DO)                                                                                                     \
    DO(record.guard.gyro.fault) DO(record.guard.force.fault) DO(record.guard.ratio.told) DO(record.filter.yaw_known)   \
    DO(record.filter.last_aided) DO(record.filter.rejected) DO(record.filter.rate_exceeded) DO(record.filter.mode)     \
    DO(record.filter.now_P[2][2]) DO(record.filter.systematic_var) DO(record.filter.scale) DO(record.filter.innovation) \
    DO(record.filter.innovation_var) DO(record.filter.static_bias[0]) DO(record.filter.static_bias[1])                 \
    DO(record.filter.static_bias[2]) DO(record.filter.bias[0]) DO(record.filter.bias[1]) DO(record.filter.bias[2])     \
    DO(record.mount.aligning) DO(record.mount.method) DO(record.mount.axis[0][0]) DO(record.mount.axis[0][1])          \
    DO(record.mount.std[0][0]) DO(record.cycles) DO(record.overruns) DO(record.down_offset)                            \
    DO(record.down_systematic) DO(record.down_torsion) DO(record.filter.now_yaw) DO(settings.aiding_old_after)         \
    DO(settings.drive_var) DO(settings.lower_var) DO(worth) DO(kept.hops) DO(refused) DO(identity.tube)                \
    DO(identity.mount_var) DO(is_told_hops) DO(kept.mail.next_number) DO(clock.exchanges) DO(clock.told.epoch)         \
    DO(clock.told.rig_us) DO(clock.told.replied_us) DO(clock.told.rig_rate) DO(clock.told.rig_var) DO(clock.var)

#define SET(path)                        \
    if (strcmp(name, #path) == 0) {      \
        memcpy(&node.path, &value, sizeof node.path); \
        return 0;                        \
    }

void shim_clear(void)
{
    memset(&node, 0, sizeof node);
}

/* The lowest bytes of the value, as many as the member has. */
int shim_set(const char *name, int64_t value)
{
    PLACES(SET)
    return -1;
}

int shim_flags(int64_t now_q28, int is_dated)
{
    return node_flags(&node, now_q28, is_dated != 0);
}

void shim_state(int64_t now_us, int64_t *out)
{
    struct borechain_native_node_state s;
    state_of_node(&node, now_us, &s);
    *out++ = s.tube;
    *out++ = s.at;
    *out++ = s.hops;
    *out++ = s.mode;
    *out++ = s.yaw;
    *out++ = s.yaw_var;
    *out++ = s.systematic_var;
    *out++ = s.gyro_bias_x;
    *out++ = s.gyro_bias_y;
    *out++ = s.gyro_bias_z;
    *out++ = s.scale_factor;
    *out++ = s.innovation;
    *out++ = s.innovation_var;
    *out++ = s.aiding_age;
    *out++ = s.clock_var;
    *out++ = s.flags;
    *out++ = s.cycles;
    *out++ = s.overruns;
    *out++ = s.alignment_x;
    *out++ = s.alignment_y;
    *out++ = s.alignment_z;
    *out++ = s.epoch;
    *out++ = s.numbered;
}

static struct borechain_native_aiding heard_of(const int64_t *in)
{
    struct borechain_native_aiding heard;
    memset(&heard, 0, sizeof heard);
    heard.yaw = (uint32_t)in[0];
    heard.yaw_var = (uint8_t)in[1];
    heard.systematic_var = (uint8_t)in[2];
    heard.offset = (int32_t)in[3];
    heard.rate = (int32_t)in[4];
    heard.sequence = (uint64_t)in[5];
    heard.hops = (int16_t)in[6];
    heard.torque = (uint32_t)in[7];
    heard.torsion_var = (uint8_t)in[8];
    heard.under_torque = (uint8_t)in[9];
    heard.valid_at = in[10];
    heard.epoch = (uint16_t)in[11];
    return heard;
}

void shim_for_step(const int64_t *in, int64_t valid_us, int64_t clock_var_us2, int64_t *out)
{
    const struct borechain_native_aiding heard = heard_of(in);
    aiding_for_step(&heard, valid_us, clock_var_us2, out);
}

void shim_for_below(const int64_t *in, int64_t *out)
{
    const struct borechain_native_aiding heard = heard_of(in);
    struct borechain_native_aiding said;
    aiding_for_below(&heard, &node.record, &said);
    *out++ = said.yaw;
    *out++ = said.yaw_var;
    *out++ = said.systematic_var;
    *out++ = said.offset;
    *out++ = said.rate;
    *out++ = (int64_t)said.sequence;
    *out++ = said.hops;
    *out++ = said.torque;
    *out++ = said.torsion_var;
    *out++ = said.under_torque;
    *out++ = said.valid_at;
    *out++ = said.epoch;
}
