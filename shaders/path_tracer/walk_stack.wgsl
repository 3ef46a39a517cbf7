// What a walk through the hierarchy still has to visit.
//
// A shallow hierarchy (`short_stack`) keeps it in eight registers that are shifted, so that lanes which push and lanes which do not take the same way; an
// array in private memory is indexed, which lanes in lock-step do one after the other. Empty places say that the walk ends.

@if(!short_stack) import constants::BVH_STACK;

// Lies below everything; a leaf by its count, but no leaf has as many triangles.
const WALK_ENDS: u32 = 0xffffffffu;

@if(short_stack) struct WalkStack {
    top: vec4u,
    below: vec4u,
}

@if(!short_stack) struct WalkStack {
    nodes: array<u32, BVH_STACK + 1>,
    height: u32,
}

fn empty_stack() -> WalkStack {
    @if(short_stack) return WalkStack(vec4u(WALK_ENDS), vec4u(WALK_ENDS));
    @if(!short_stack) {
        var stack: WalkStack;
        stack.nodes[0] = WALK_ENDS;
        stack.height = 1u;
        return stack;
    }
}

fn push_node(stack: ptr<function, WalkStack>, node: u32) {
    @if(short_stack) {
        (*stack).below = vec4u((*stack).top.w, (*stack).below.xyz);
        (*stack).top = vec4u(node, (*stack).top.xyz);
    }
    @if(!short_stack) {
        (*stack).nodes[(*stack).height] = node;
        (*stack).height += 1u;
    }
}

fn pop_node(stack: ptr<function, WalkStack>) -> u32 {
    @if(short_stack) {
        let node = (*stack).top.x;
        (*stack).top = vec4u((*stack).top.yzw, (*stack).below.x);
        (*stack).below = vec4u((*stack).below.yzw, WALK_ENDS);
        return node;
    }
    @if(!short_stack) {
        (*stack).height -= 1u;
        return (*stack).nodes[(*stack).height];
    }
}
