/* Start of the chip: memory that begins as zeros, then main. There is no other data. */
#include <stdint.h>

extern uint32_t __bss_start__, __bss_end__, __StackTop;
extern int main(void);

static void reset(void)
{
    uint32_t *word;
    for (word = &__bss_start__; word < &__bss_end__; word++) {
        *word = 0u;
    }
    (void)main();
    for (;;) {
    }
}

static void hang(void)
{
    for (;;) {
    }
}

__attribute__((section(".vectors"), used)) void *const vectors[16] = {
    &__StackTop, (void *)reset, (void *)hang, (void *)hang, (void *)hang, (void *)hang, (void *)hang};
