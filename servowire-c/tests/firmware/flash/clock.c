/* The time base. */
#include "servowire.h"
int main(void);
static sw_clock_t clk;
static volatile uint32_t timer;
int main(void)
{
    (void)sw_clock_start(&clk, 170000000, timer);
    return (int)sw_clock_ns(&clk, timer);
}
