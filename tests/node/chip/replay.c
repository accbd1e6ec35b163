/* Replays recorded calls of the step and compares answer and record after each: on this machine, or bare in QEMU.
 *
 * A file of records, each: kind, slot, length in bytes (int32), then the bytes. See recorded_calls.py. With COUNT_ON_CHIP
 * it also counts instructions (SysTick, `-icount shift=0`) and how deep the stack went. */
#include <stdio.h>
#include <string.h>

#include "borechain_step.h"
#ifdef FROM_IMAGE
#include "borechain_image.h"
#endif

enum { NODE, SETTINGS, PARAMETERS, STEP, AIDING, LAST, KEEP, PATCH, BACK };
#define SLOTS 4
#define WORDS (sizeof(struct borechain_node) / 4)
#define STACK_WORDS 2048
#define TOLD_EVERY 10000 /* calls, after which it says how far it is: one that is ended has said something */

static struct borechain_node nodes[SLOTS], kept;
static struct borechain_settings settings[SLOTS];
static struct borechain_parameters parameters[SLOTS][1 + BORECHAIN_IMUS];
static int64_t readings[BORECHAIN_IMUS][20], moment[8], aiding[12];
static union {
    int64_t words[sizeof(struct borechain_node) / 8 + 2048];
    struct borechain_node node;
} body;
static int slot;
static int64_t answer;
static int undefined; /* an operation of the newest call */

static void call_step(void)
{
    answer = borechain_step(&nodes[slot], &settings[slot], parameters[slot], readings, moment);
}

static void call_aiding(void)
{
    answer = borechain_aiding(&nodes[slot], &settings[slot], aiding);
}

#ifdef COUNT_ON_CHIP
#define TICK 40 /* instructions a tick of SysTick (25 MHz) with -icount shift=0 */
static uint32_t stack[STACK_WORDS] __attribute__((aligned(16)));
static unsigned long steps, aidings, most[2], total[2], deepest;

static uint32_t ticks(void)
{
    return 0xFFFFFF - *(volatile uint32_t *)0xE000E018;
}

__attribute__((naked, noinline)) static void on_stack(void (*call)(void), void *top)
{
    (void)call;
    (void)top;
    __asm volatile("push {r4,lr}\n mov r4,sp\n mov sp,r1\n blx r0\n mov sp,r4\n pop {r4,pc}\n");
}

static void run(void (*call)(void), int kind)
{
    for (int k = 0; k < STACK_WORDS; k++) {
        stack[k] = 0xA5A5A5A5u;
    }
    uint32_t before = ticks();
    on_stack(call, stack + STACK_WORDS);
    unsigned long took = ((ticks() - before) & 0xFFFFFF) * TICK;
    unsigned long left = 0;
    while (left < STACK_WORDS && stack[left] == 0xA5A5A5A5u) {
        left++;
    }
    deepest = 4 * (STACK_WORDS - left) > deepest ? 4 * (STACK_WORDS - left) : deepest;
    most[kind] = took > most[kind] ? took : most[kind];
    total[kind] += took;
    kind ? aidings++ : steps++;
}

static void begin(void)
{
    *(volatile uint32_t *)0xE000E014 = 0xFFFFFF;
    *(volatile uint32_t *)0xE000E018 = 0;
    *(volatile uint32_t *)0xE000E010 = 5;
}

static void report(void)
{
    printf("step_mean %lu step_most %lu aiding_mean %lu aiding_most %lu stack %lu\n", total[0] / (steps ? steps : 1),
        most[0], total[1] / (aidings ? aidings : 1), most[1], deepest);
}
#else
#ifdef TRAPPED /* with -fsanitize=undefined -fsanitize-undefined-trap-on-error: such a call is ended and not compared */
#include <setjmp.h>
#include <signal.h>

static sigjmp_buf before_call;

static void leave_call(int signal)
{
    siglongjmp(before_call, signal);
}

static void run(void (*call)(void), int kind)
{
    (void)kind;
    signal(SIGILL, leave_call);
    undefined = sigsetjmp(before_call, 1) != 0;
    if (!undefined) {
        call();
    }
}
#else
static void run(void (*call)(void), int kind)
{
    (void)kind;
    call();
}
#endif

static void begin(void)
{
}

static void report(void)
{
}
#endif

static void sums_of(const void *record, uint32_t *plain, uint32_t *weighted)
{
    uint32_t sum = 0, sum_of_sums = 0;
    const unsigned char *at = record;
    for (size_t k = 0; k < WORDS; k++) {
        uint32_t word;
        memcpy(&word, at + 4 * k, 4);
        sum += word;
        sum_of_sums += sum;
    }
    *plain = sum;
    *weighted = sum_of_sums;
}

int main(int count, char **names)
{
    FILE *file = fopen(count > 1 ? names[1] : "calls.bin", "rb");
    long calls = 0, wrong = 0, records = 0, meaningless = 0;
    int32_t head[3];
    if (file == NULL) {
        puts("no calls.bin");
        return 2;
    }
#ifdef FROM_IMAGE
    static unsigned char page[1 << 17];
    FILE *image = fopen(names[count - 1], "rb");
    if (image == NULL || borechain_load(page, fread(page, 1, sizeof page, image), settings, parameters[0], nodes)) {
        puts("no image");
        return 2;
    }
#endif
    begin();
    while (fread(head, 4, 3, file) == 3) {
        if (head[2] > (int32_t)sizeof body || fread(&body, 1, (size_t)head[2], file) != (size_t)head[2]) {
            puts("cut");
            return 2;
        }
        slot = head[1];
        switch (head[0]) {
        case NODE:
            memcpy(&nodes[slot], &body, (size_t)head[2]);
            break;
        case SETTINGS:
            memcpy(&settings[slot], &body, (size_t)head[2]);
            break;
        case PARAMETERS:
            memcpy(parameters[slot], &body, (size_t)head[2]);
            break;
        case KEEP:
            kept = nodes[slot];
            break;
        case PATCH: {
            int32_t place[2];
            memcpy(place, &body, sizeof place);
            memcpy((char *)&nodes[slot] + place[0], (char *)&body + sizeof place, (size_t)place[1]);
            break;
        }
        case BACK:
            nodes[slot] = kept;
            break;
        case LAST:
            records++;
            wrong += memcmp(&nodes[slot], &body, (size_t)head[2]) != 0;
            break;
        default: {
            int64_t *tail = body.words;
            if (head[0] == STEP) {
                int64_t imus = *tail++;
                memcpy(readings, tail, (size_t)imus * sizeof readings[0]);
                tail += imus * 20;
                memcpy(moment, tail, sizeof moment);
                tail += 8;
                run(call_step, 0);
            } else {
                memcpy(aiding, tail, sizeof aiding);
                tail += 12;
                run(call_aiding, 1);
            }
            calls++;
            if (calls % TOLD_EVERY == 0) {
                printf("calls %ld wrong %ld\n", calls, wrong);
                fflush(stdout);
            }
            if (undefined) { /* in Python as in C */
                printf("undefined %ld\n", calls);
                meaningless++;
                break;
            }
            uint32_t plain, weighted, expected[2];
            memcpy(expected, tail + 1, 8);
            sums_of(&nodes[slot], &plain, &weighted);
            if (answer != tail[0] || plain != expected[0] || weighted != expected[1]) {
                if (wrong++ < 5) {
                    printf("call %ld kind %d: answer %ld, expected %ld\n", calls, (int)head[0], (long)answer, (long)tail[0]);
                }
#ifdef ENDS_AT_WRONG
                return 1;
#endif
            }
        }
        }
    }
    fclose(file);
    report();
    printf("calls %ld records %ld wrong %ld undefined %ld\n", calls, records, wrong, meaningless);
    return wrong != 0 || calls == 0;
}
