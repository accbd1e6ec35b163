#define LIMIT INT64_C(0x10000000000)
#define SIZE 16
struct integers_2 {
    int64_t at[2];
};
static const int32_t table_table[3] = {
    3, -5, 70000
};
/* A shift and a power. (node/translated_forms.py:14) */
int64_t c_scaled_by(int64_t a, int64_t places)
{
    return shift_left(a, 3) + shift_right(a, places) - 32 * a + (places > 2 ? a : (-INT64_C(1099511627760)));
}

/* Bits, quotients and remainders. (node/translated_forms.py:20) */
int64_t c_joined_words(int64_t a, int64_t b)
{
    int64_t c = (a & 255) | (b ^ (~a));
    return shift_right(c, 4) + (a & (SIZE - 1)) - floor_divide(c, b) * floor_modulo(a, b) + -c + +a;
}

/* A shift and a power. (node/translated_forms.py:14) */
static int64_t scaled_by(int64_t a, int64_t places)
{
    return shift_left(a, 3) + shift_right(a, places) - 32 * a + (places > 2 ? a : (-INT64_C(1099511627760)));
}

/* Choices within choices, chains of comparisons and truths. (node/translated_forms.py:27) */
int64_t c_chosen_one(int64_t a, int64_t b)
{
    bool near = -SIZE <= a - b && a - b < SIZE;
    bool far = is_beyond_upto(1, scaled_by(a, 2), b);
    if ((near && !far) || (a == 1 || a == -2 || a == SIZE)) {
        return !(a == 4 || a == 5) ? least(least(a, b), 3) : most(magnitude(a), b);
    }
    if ((a != 0) == (b != 0)) {
        b -= 1;
    } else {
        const int64_t held_0 = b;
        const int64_t held_1 = a;
        a = held_0;
        b = held_1;
    }
    return (a > b ? a : b > 0 ? b : 0) + near;
}

/* Loops of each kind, with an index down, a tuple and a while. (node/translated_forms.py:41) */
int64_t c_walked_over(int64_t *values, int64_t first)
{
    int64_t total = 0;
    for (int64_t k = 0; k < 5; k++) {
        total += values[k] * table_table[floor_modulo(k, 3)];
    }
    for (int64_t k = 7, k_end = first; k > k_end; k--) {
        if (k == 3) {
            continue;
        }
        total -= k;
    }
    const int64_t part_of[3] = {1, first, table_table[2]};
    for (int64_t part_at = 0; part_at < 3; part_at++) {
        const int64_t part = part_of[part_at];
        total = total * 2 + part;
    }
    while (total > LIMIT) {
        total = shift_right(total, 1);
        if (total == 5) {
            break;
        }
    }
    return total;
}

/* Two numbers. (node/translated_forms.py:60) */
static struct integers_2 two_of(int64_t a, int64_t b)
{
    return (struct integers_2){{a + b, a - b}};
}

/* Loops of each kind, with an index down, a tuple and a while. (node/translated_forms.py:41) */
static int64_t walked_over(int64_t *values, int64_t first)
{
    int64_t total = 0;
    for (int64_t k = 0; k < 3; k++) {
        total += values[k] * table_table[floor_modulo(k, 3)];
    }
    for (int64_t k = 7, k_end = first; k > k_end; k--) {
        if (k == 3) {
            continue;
        }
        total -= k;
    }
    const int64_t part_of[3] = {1, first, table_table[2]};
    for (int64_t part_at = 0; part_at < 3; part_at++) {
        const int64_t part = part_of[part_at];
        total = total * 2 + part;
    }
    while (total > LIMIT) {
        total = shift_right(total, 1);
        if (total == 5) {
            break;
        }
    }
    return total;
}

/* A slice that is handed on, with its length. (node/translated_forms.py:81) */
static void fill_slice(int64_t *values, int64_t by)
{
    for (int64_t k = 0; k < 7; k++) {
        values[k] = k > 0 ? by : values[k] - by;
    }
}

/* Fields, elements and slices of a record. (node/translated_forms.py:66) */
static void c_stored_in(struct borechain_state *state, int64_t a)
{
    const struct integers_2 held_0 = two_of(a, state->cycles);
    int64_t total = held_0.at[0];
    int64_t difference = held_0.at[1];
    state->cycles = total;
    state->static_bias[1] = difference;
    int64_t *row = state->P[2];
    row[3] += a;
    state->P[0][1] = walked_over(state->static_bias, a) + state->P[1][0];
    state->yaw = (uint32_t)a;
    for (int64_t j = 1; j < 3; j++) {
        state->P[j][3 - j] = state->yaw;
    }
    fill_slice(&state->P[3][1], state->ring_rate[a][0]);
}
