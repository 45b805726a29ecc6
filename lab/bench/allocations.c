/* Counts what Python's allocators give out. Made and loaded by budget.py; needs no header of Python. */

#include <stddef.h>

typedef struct {
    void *context;
    void *(*malloc)(void *, size_t);
    void *(*calloc)(void *, size_t, size_t);
    void *(*realloc)(void *, void *, size_t);
    void (*free)(void *, void *);
} Allocator; /* as PyMemAllocatorEx in Include/cpython/pymem.h */

extern void PyMem_GetAllocator(int, Allocator *);
extern void PyMem_SetAllocator(int, Allocator *);

enum { MEMORY = 1, OBJECTS = 2 }; /* PYMEM_DOMAIN_MEM, PYMEM_DOMAIN_OBJ */

static Allocator before[3];
static unsigned long long count; /* the interpreter's lock is held in both domains */

static void *counted_malloc(void *context, size_t size) {
    Allocator *own = context;
    count++;
    return own->malloc(own->context, size);
}

static void *counted_calloc(void *context, size_t items, size_t size) {
    Allocator *own = context;
    count++;
    return own->calloc(own->context, items, size);
}

static void *counted_realloc(void *context, void *old, size_t size) {
    Allocator *own = context;
    count++;
    return own->realloc(own->context, old, size);
}

static void passed_free(void *context, void *old) {
    Allocator *own = context;
    own->free(own->context, old);
}

void count_allocations(void) {
    for (int domain = MEMORY; domain <= OBJECTS; domain++) {
        PyMem_GetAllocator(domain, &before[domain]);
        Allocator counting = {&before[domain], counted_malloc, counted_calloc, counted_realloc, passed_free};
        PyMem_SetAllocator(domain, &counting);
    }
}

unsigned long long allocations(void) { return count; }
