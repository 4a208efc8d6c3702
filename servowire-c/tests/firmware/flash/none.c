/* The empty program. */
int main(void);
int main(void) { return 0; }
