/* Start of a Cortex-M4F program in QEMU: floating point on, main, exit by semihosting. */
#include <stdint.h>

extern uint32_t stack_top;
int main(void);

static void stop(void)
{
    /* SYS_EXIT with ADP_Stopped_ApplicationExit. */
    __asm volatile("movs r0, #0x18\n movw r1, #0x26\n movt r1, #0x2\n bkpt 0xab");
    for (;;) {
    }
}

void reset(void)
{
    *(volatile uint32_t *)0xE000ED88u |= UINT32_C(0xF) << 20; /* CPACR: full access to the floating point unit */
    __asm volatile("dsb\n isb");
    (void)main();
    stop();
}

__attribute__((section(".vectors"), used)) static void *const vectors[16] = {
    &stack_top, (void *)reset, (void *)stop, (void *)stop, (void *)stop, (void *)stop, (void *)stop,
};
