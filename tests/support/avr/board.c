// An Arduino with its firmware in simavr: board ELF UART_FD REPORT_FD.
//
// The UART is a file descriptor, at 500000 baud. Each change of a PWM output is reported as
// "TIME_US TIMER CHANNEL LEVEL", and the time every tenth of a second. Simulated time does not run ahead
// of the clock.
// The few declarations of libsimavr that are needed; Debian has the library without its headers.

#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

typedef struct avr_t avr_t;
typedef struct avr_irq_t avr_irq_t;
typedef uint64_t (*timer_t_)(avr_t *, uint64_t, void *);
avr_t *avr_make_mcu_by_name(const char *);
int avr_init(avr_t *);
int avr_run(avr_t *);
int elf_read_firmware(const char *, void *);
void avr_load_firmware(avr_t *, void *);
int avr_ioctl(avr_t *, uint32_t, void *);
avr_irq_t *avr_io_getirq(avr_t *, uint32_t, int);
void avr_irq_register_notify(avr_irq_t *, void (*)(avr_irq_t *, uint32_t, void *), void *);
void avr_raise_irq(avr_irq_t *, uint32_t);
void avr_cycle_timer_register(avr_t *, uint64_t, timer_t_, void *);

#define CTL(a, b, c, d) ((uint32_t)(a) << 24 | (uint32_t)(b) << 16 | (uint32_t)(c) << 8 | (d))
#define HZ 16000000u
#define TICK (HZ / 1000)
#define BYTES_PER_TICK 50  // 500000 baud

static int uart, report;
static avr_irq_t *input;
static uint64_t now;

static uint64_t wall_us(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec * 1000000ull + t.tv_nsec / 1000;
}

static uint64_t tick(avr_t *avr, uint64_t when, void *start) {
    now = when;
    int64_t ahead = (int64_t)(when / (HZ / 1000000)) - (int64_t)(wall_us() - *(uint64_t *)start);
    if (ahead > 0) usleep(ahead);
    struct pollfd waiting = {uart, POLLIN, 0};
    uint8_t bytes[BYTES_PER_TICK];
    if (poll(&waiting, 1, 0) > 0 && waiting.revents & POLLIN) {
        ssize_t n = read(uart, bytes, sizeof bytes);
        for (ssize_t i = 0; i < n; i++) avr_raise_irq(input, bytes[i]);
    }
    if (when / TICK % 100 == 0)
        dprintf(report, "%llu\n", (unsigned long long)(when / (HZ / 1000000)));
    return when + TICK;
}

static void sent(avr_irq_t *irq, uint32_t value, void *unused) {
    uint8_t byte = value;
    if (write(uart, &byte, 1) < 0) return;  // nobody has the port open
}

static void changed(avr_irq_t *irq, uint32_t value, void *output) {
    static int levels[6];
    intptr_t at = (intptr_t)output;
    if (levels[at] == (int)value) return;
    levels[at] = value;
    dprintf(report, "%llu %d %d %u\n", (unsigned long long)(now / (HZ / 1000000)), (int)at / 2,
            (int)at % 2, value);
}

int main(int argc, char **argv) {
    static uint32_t firmware[1 << 14];  // larger than simavr's structure; its clock is at byte 64
    if (argc != 4 || elf_read_firmware(argv[1], firmware)) return 2;
    uart = atoi(argv[2]);
    report = atoi(argv[3]);
    avr_t *avr = avr_make_mcu_by_name("atmega328p");
    if (!avr) return 2;
    avr_init(avr);
    firmware[16] = HZ;
    avr_load_firmware(avr, firmware);
    uint32_t quiet = 0;
    avr_ioctl(avr, CTL('u', 'a', 's', '0'), &quiet);
    input = avr_io_getirq(avr, CTL('u', 'a', 'r', '0'), 0);
    avr_irq_register_notify(avr_io_getirq(avr, CTL('u', 'a', 'r', '0'), 1), sent, 0);
    for (intptr_t i = 0; i < 6; i++)
        avr_irq_register_notify(avr_io_getirq(avr, CTL('t', 'm', 'r', '0' + i / 2), i % 2), changed,
                                (void *)i);
    uint64_t start = wall_us();
    avr_cycle_timer_register(avr, TICK, tick, &start);
    for (;;) {
        int state = avr_run(avr);
        if (state == 4 || state == 5) return 1;  // done or crashed
    }
}
