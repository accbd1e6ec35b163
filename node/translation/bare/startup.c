/* Start of a bare Arm chip in QEMU; the library of the compiler speaks to the host by semihosting. */
#include <stdint.h>

extern void _start(void);
extern uint32_t __StackTop;

static void reset(void)
{
    _start();
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
