/* Seeks calls whose comparisons lie at their bounds: of recorded calls, words are moved until two sides of a comparison
 * are equal, or one apart; so are calls that reach comparisons which no call has reached.
 *
 *     seek calls.bin words.bin EVALUATIONS > found.txt
 *
 * The compiler tells every comparison (-fsanitize-coverage=trace-cmp). A call in which an operation is undefined traps and
 * is not taken. Each line that is found: number of the recorded call, then place, bytes and new number of each word moved.
 * words.bin: place and bytes (int32) in `struct inputs` of every word that may be moved. See bound_calls.py. */
#include <setjmp.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "borechain_step.h"

enum { NODE, SETTINGS, PARAMETERS, STEP, AIDING };
enum { SLOTS = 4, GOALS = 5, BELOW_BY_ONE = 0, EQUAL, ABOVE_BY_ONE, BELOW, ABOVE };
enum { TEXT = 1 << 20, SITES = 1 << 14, WORDS = 1 << 13, MOVED = 8, BASES = 1 << 14, LONGEST = 1 << 20 };
enum { ENOUGH = 12 /* calls for each goal */, ANY = 32 /* of so many words moved far one is kept, whatever it compares */ };
enum { FEW = 3 /* bases for each comparison */, TRIALS = 14, INFLUENCES = 5 };

struct inputs { /* all that a call reads, in the order of bound_calls.py */
    struct borechain_node node;
    struct borechain_settings settings;
    struct borechain_parameters parameters[1 + BORECHAIN_IMUS];
    int64_t readings[BORECHAIN_IMUS][20], moment[8], aiding[12];
};
struct move {
    int32_t at, bytes;
    int64_t value;
};
struct base {
    struct inputs inputs;
    long call;
    int kind, moves;
    struct move moved[MOVED];
};
struct site {
    int64_t apart; /* of the two sides, the first time in the newest call */
    long seen;     /* newest call */
    int met, count[GOALS], bases, calls;
    uint64_t lengths[2], met_lengths[2]; /* bits of numbers below, above: of all calls, of the newest */
};
struct influence { int word; int64_t to, apart; };

static struct site sites[SITES];
static int numbers[TEXT], site_count, hit[SITES], hits;
static long evaluation, most_evaluations, events;
static struct base *bases[BASES];
static struct { int32_t at, bytes; } words[WORDS];
static struct influence influences[SITES][INFLUENCES];
static int base_count, word_count, influence_count[SITES];
static struct inputs work;
static sigjmp_buf before_call;
static uint64_t chance = 54;

static uint32_t drawn(void)
{
    chance = chance * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(chance >> 33);
}

static void compared(void *from, int64_t one, int64_t other)
{
    const size_t at = (size_t)((char *)from - (char *)borechain_step) + TEXT / 2;
    if (++events > LONGEST) {
        siglongjmp(before_call, 1);
    }
    if (at >= TEXT) {
        return;
    }
    if (numbers[at] == 0 && site_count < SITES - 1) {
        numbers[at] = ++site_count;
    }
    struct site *site = &sites[numbers[at]];
    int64_t apart;
    if (__builtin_sub_overflow(one, other, &apart)) {
        apart = one < other ? INT64_MIN / 2 : INT64_MAX / 2;
    }
    if (site->seen != evaluation) {
        site->seen = evaluation;
        site->apart = apart;
        site->met = 0;
        site->met_lengths[0] = site->met_lengths[1] = 0;
        hit[hits++] = numbers[at];
    }
    site->met |= 1 << (apart < -1 ? BELOW : apart > 1 ? ABOVE : EQUAL + apart);
    site->met_lengths[apart > 0] |= UINT64_C(1) << (63 - __builtin_clzll((uint64_t)(apart < 0 ? -apart : apart) | 1));
}

#define TELLS(name, type) \
    void name(type one, type other) \
    { \
        compared(__builtin_return_address(0), (int64_t)one, (int64_t)other); \
    }
/* Of low <= x && x <= high the compiler makes x - low <= high - low without a sign: the lower bound is at 0. */
#define TELLS_RANGE(name, type) \
    void name(type one, type other) \
    { \
        char *from = __builtin_return_address(0); \
        compared(from, (int64_t)one, (int64_t)other); \
        if ((int64_t)one > 1) { \
            compared(from + 1, 0, (int64_t)other); \
        } \
    }
TELLS(__sanitizer_cov_trace_cmp1, int8_t)
TELLS(__sanitizer_cov_trace_cmp2, int16_t)
TELLS(__sanitizer_cov_trace_cmp4, int32_t)
TELLS(__sanitizer_cov_trace_cmp8, int64_t)
TELLS(__sanitizer_cov_trace_const_cmp1, int8_t)
TELLS(__sanitizer_cov_trace_const_cmp2, int16_t)
TELLS_RANGE(__sanitizer_cov_trace_const_cmp4, int32_t)
TELLS_RANGE(__sanitizer_cov_trace_const_cmp8, int64_t)

void __sanitizer_cov_trace_switch(uint64_t value, void *cases)
{
    (void)value;
    (void)cases;
}

static void leave_call(int signal)
{
    siglongjmp(before_call, signal);
}

/* Whether the call of these inputs has a meaning; what it compared stands in `sites` and `hit`. */
static int makes_sense(const struct inputs *inputs, int kind)
{
    memcpy(&work, inputs, sizeof work);
    evaluation++;
    hits = 0, events = 0;
    if (sigsetjmp(before_call, 1)) {
        return 0;
    }
    const int64_t answer = kind == STEP
        ? borechain_step(&work.node, &work.settings, work.parameters, work.readings, work.moment)
        : borechain_aiding(&work.node, &work.settings, work.aiding);
    return answer != BORECHAIN_OTHER_LAYOUT;
}

/* How many goals the newest call met that had not been met often enough; sides further apart than ever are goals too. */
static int count_goals(void)
{
    int news = 0;
    for (int k = 0; k < hits; k++) {
        struct site *site = &sites[hit[k]];
        for (int goal = 0; goal < GOALS; goal++) {
            if ((site->met >> goal & 1) && site->count[goal] < (goal > ABOVE_BY_ONE ? 1 : ENOUGH)) {
                site->count[goal]++;
                news++;
            }
        }
        for (int side = 0; side < 2; side++) {
            news += (site->met_lengths[side] & ~site->lengths[side]) != 0;
            site->lengths[side] |= site->met_lengths[side];
        }
    }
    return news;
}

static int wants(const struct site *site)
{
    return site->count[0] < ENOUGH || site->count[1] < ENOUGH || site->count[2] < ENOUGH;
}

static int64_t get(const struct inputs *inputs, int word)
{
    int64_t value = 0;
    memcpy(&value, (const char *)inputs + words[word].at, (size_t)words[word].bytes);
    return value;
}

static void set(struct inputs *inputs, int word, int64_t value)
{
    memcpy((char *)inputs + words[word].at, &value, (size_t)words[word].bytes);
}

static void keep_base(const struct base *like, int word, int64_t value)
{
    if (base_count >= BASES) {
        return;
    }
    struct base *new = malloc(sizeof *new);
    *new = *like;
    if (word >= 0) {
        set(&new->inputs, word, value);
        new->moved[new->moves++] = (struct move){words[word].at, words[word].bytes, value};
    }
    bases[base_count++] = new;
}

/* Whether a base with one word moved is a call; one of which something is new is told, or `anyhow` each. */
static int tried(struct base *base, int word, int64_t value, int anyhow)
{
    const int64_t own = get(&base->inputs, word);
    set(&base->inputs, word, value);
    const int sense = makes_sense(&base->inputs, base->kind);
    set(&base->inputs, word, own);
    if (!sense) {
        return 0;
    }
    if (count_goals() || anyhow) {
        int reached = 0;
        for (int k = 0; k < hits; k++) {
            reached |= sites[hit[k]].bases < FEW && wants(&sites[hit[k]]);
        }
        printf("%ld", base->call);
        for (int k = 0; k < base->moves; k++) {
            printf(" %d %d %lld", base->moved[k].at, base->moved[k].bytes, (long long)base->moved[k].value);
        }
        printf(" %d %d %lld\n", words[word].at, words[word].bytes, (long long)value);
        if (reached && base->moves < MOVED - 1) {
            for (int k = 0; k < hits; k++) {
                sites[hit[k]].bases += wants(&sites[hit[k]]);
            }
            keep_base(base, word, value);
        }
    }
    return 1;
}

/* Move one word until the two sides of a comparison are `goal` apart: by the line through two numbers, and by halves. */
static void seek(struct base *base, int number, struct influence from, int64_t start_apart, int64_t goal)
{
    int64_t low = get(&base->inputs, from.word), high = from.to;
    __int128 low_off = (__int128)start_apart - goal, high_off = (__int128)from.apart - goal;
    for (int k = 0; k < TRIALS && low_off != high_off && high_off != 0; k++) {
        const int parted = (low_off < 0) != (high_off < 0);
        const double share = (double)low_off / ((double)low_off - (double)high_off);
        double step = k % 3 == 2 && parted ? 0.5 * ((double)high - (double)low) : share * ((double)high - (double)low);
        if (step > 1e17 || step < -1e17) {
            return;
        }
        int64_t next = low + (int64_t)(step < 0 ? step - 0.5 : step + 0.5);
        if (next == low || next == high) {
            next += low < high ? 1 : -1;
        }
        const long before = evaluation;
        if (!tried(base, from.word, next, 0) || sites[number].seen != before + 1) {
            return;
        }
        const __int128 off = (__int128)sites[number].apart - goal;
        if (off == 0) {
            return;
        }
        if (parted && (off < 0) == (low_off < 0)) {
            low = next, low_off = off;
        } else if (parted) {
            high = next, high_off = off;
        } else {
            low = high, low_off = high_off;
            high = next, high_off = off;
        }
    }
}

static int64_t moved_by(int64_t value)
{
    if (value >= 0 && value < 64) {
        return value + 1;
    }
    return drawn() & 1 ? value + value / 8 : value - value / 8;
}

/* A number of any length, or one of which some bits are others. */
static int64_t far_from(int64_t value)
{
    const int64_t any = (int64_t)((uint64_t)drawn() << 32 ^ (uint64_t)drawn() << 1) >> (drawn() % 63);
    return drawn() & 1 ? any : value ^ any;
}

/* Which words move which comparisons of a base, and these words to the goals. */
static void explore(struct base *base)
{
    static int wanted[SITES];
    static int64_t apart[SITES];
    int count = 0;
    if (!makes_sense(&base->inputs, base->kind)) {
        return;
    }
    for (int k = 0; k < hits; k++) {
        if (wants(&sites[hit[k]])) {
            wanted[count] = hit[k];
            apart[count] = sites[hit[k]].apart;
            influence_count[count++] = 0;
        }
    }
    for (int word = 0; word < word_count && evaluation < most_evaluations; word++) {
        const int64_t own = get(&base->inputs, word), to = moved_by(own);
        if (own >= 0 && own < 64) {
            tried(base, word, own == 0 ? 2 : 0, 0);
        }
        tried(base, word, far_from(own), drawn() % ANY == 0);
        if (!tried(base, word, to, 0)) {
            continue;
        }
        for (int k = 0; k < count; k++) {
            const struct site *site = &sites[wanted[k]];
            if (site->seen == evaluation && site->apart != apart[k]) {
                const int at = influence_count[k] < INFLUENCES ? influence_count[k]++ : (int)(drawn() % (2 * INFLUENCES));
                if (at < INFLUENCES) {
                    influences[k][at] = (struct influence){word, to, site->apart};
                }
            }
        }
    }
    for (int k = 0; k < count && evaluation < most_evaluations; k++) {
        for (int j = 0; j < influence_count[k]; j++) {
            for (int64_t goal = -1; goal <= 1; goal++) {
                if (sites[wanted[k]].count[goal + 1] < ENOUGH) {
                    seek(base, wanted[k], influences[k][j], apart[k], goal);
                }
            }
        }
    }
}

/* Count which comparisons the recorded calls make; or, `choosing`, take some of each for bases, from all over the file. */
static void read_calls(FILE *file, int choosing)
{
    static struct borechain_node nodes[SLOTS];
    static struct borechain_settings settings[SLOTS];
    static struct borechain_parameters parameters[SLOTS][1 + BORECHAIN_IMUS];
    static int64_t body[sizeof(struct borechain_node) / 8 + 2048];
    static struct base base;
    int32_t head[3];
    long call = 0;
    rewind(file);
    while (fread(head, 4, 3, file) == 3 && fread(body, 1, (size_t)head[2], file) == (size_t)head[2]) {
        const int slot = head[1];
        if (head[0] == NODE) {
            memcpy(&nodes[slot], body, (size_t)head[2]);
        } else if (head[0] == SETTINGS) {
            memcpy(&settings[slot], body, (size_t)head[2]);
        } else if (head[0] == PARAMETERS) {
            memcpy(parameters[slot], body, (size_t)head[2]);
        }
        if (head[0] != STEP && head[0] != AIDING) {
            continue;
        }
        memset(&base, 0, sizeof base);
        base.call = call++;
        base.kind = head[0];
        base.inputs.node = nodes[slot];
        base.inputs.settings = settings[slot];
        memcpy(base.inputs.parameters, parameters[slot], sizeof base.inputs.parameters);
        if (head[0] == STEP) {
            memcpy(base.inputs.readings, body + 1, (size_t)body[0] * sizeof base.inputs.readings[0]);
            memcpy(base.inputs.moment, body + 1 + 20 * body[0], sizeof base.inputs.moment);
        } else {
            memcpy(base.inputs.aiding, body, sizeof base.inputs.aiding);
        }
        if (!makes_sense(&base.inputs, base.kind)) {
            fprintf(stderr, "call %ld has no meaning\n", base.call);
            exit(2);
        }
        nodes[slot] = work.node;
        int rare = 0;
        for (int k = 0; k < hits; k++) {
            struct site *site = &sites[hit[k]];
            site->calls += !choosing;
            rare |= choosing && site->bases < FEW && drawn() % (uint32_t)site->calls < 2 * FEW;
        }
        if (!choosing) {
            count_goals();
        } else if (rare) {
            for (int k = 0; k < hits; k++) {
                sites[hit[k]].bases++;
            }
            keep_base(&base, -1, 0);
        }
    }
}

int main(int count, char **names)
{
    FILE *calls = count == 4 ? fopen(names[1], "rb") : NULL, *places = count == 4 ? fopen(names[2], "rb") : NULL;
    if (calls == NULL || places == NULL) {
        return 2;
    }
    most_evaluations = atol(names[3]);
    word_count = (int)fread(words, sizeof words[0], WORDS, places);
    const int signals[] = {SIGILL, SIGSEGV, SIGFPE, SIGBUS, SIGTRAP};
    for (int k = 0; k < 5; k++) {
        signal(signals[k], leave_call);
    }
    read_calls(calls, 0);
    read_calls(calls, 1);
    const long read = evaluation;
    most_evaluations += read;
    fprintf(stderr, "sites %d bases %d read %ld\n", site_count, base_count, read);
    for (int k = 0; k < base_count && evaluation < most_evaluations; k++) {
        explore(bases[k]);
    }
    fprintf(stderr, "sites %d bases %d evaluations %ld\n", site_count, base_count, evaluation - read);
    return 0;
}
