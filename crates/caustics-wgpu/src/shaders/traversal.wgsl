// What is left of a ray's way through a hierarchy.

// Nodes that wait on a traversal's stack; the builder sees to it that there are no more.
const MAX_WAITING: u32 = 64u;

struct Traversal {
    // Where to go next; NO_PRIMITIVE where it is over.
    current: u32,
    closest: Hit,
    waiting_count: u32,
    waiting: array<u32, MAX_WAITING>,
}

fn let_wait(left: ptr<function, Traversal>, node: u32) {
    (*left).waiting[(*left).waiting_count] = node;
    (*left).waiting_count += 1u;
}

fn next_waiting(left: ptr<function, Traversal>) -> u32 {
    if (*left).waiting_count == 0u {
        return NO_PRIMITIVE;
    }
    (*left).waiting_count -= 1u;
    return (*left).waiting[(*left).waiting_count];
}
