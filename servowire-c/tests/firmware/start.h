#ifndef START_H
#define START_H

#include <stdint.h>

void print(const char *text);
void print_number(uint32_t number);
_Noreturn void leave(int code); /* ends the emulator with this code */
int main(void);

#endif
