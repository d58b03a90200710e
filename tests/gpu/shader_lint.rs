//! What no compiler at hand refuses, but browsers and GPUs do, or silently get wrong.

use std::collections::HashSet;

use faircurve::gpu::reflect::{parse, reflect};
use faircurve::gpu::source;
use faircurve::kernels;
use naga::{AddressSpace, Binding, Block, BuiltIn, Expression, Function, Handle, LocalVariable, Module, Statement};

/// Workgroup memory every WebGPU device has.
const WORKGROUP_BYTES: u32 = 16 * 1024;

/// Threads a workgroup every WebGPU device has.
const WORKGROUP_THREADS: u32 = 256;

#[test]
fn every_kernel_is_valid_and_within_the_limits_of_any_device() {
    let mut seen = HashSet::new();
    for key in kernels() {
        let reflection = reflect(&key.name(), &key.wgsl(), key.entry).unwrap_or_else(|error| panic!("{error}"));
        assert!(reflection.workgroup_bytes <= WORKGROUP_BYTES, "{}: {}", key.name(), reflection.workgroup_bytes);
        assert!(reflection.workgroup_size <= WORKGROUP_THREADS, "{}: {}", key.name(), reflection.workgroup_size);
        // Storage bindings beyond eight are more than a default WebGPU device grants. Kernels that read the table of a
        // surface run where there is a ninth.
        let most = if key.definitions.contains_key("SURFACE_TABLE") { 9 } else { 8 };
        let storage =
            reflection.bindings.iter().filter(|b| b.access != faircurve::gpu::reflect::Access::Uniform).count();
        assert!(storage <= most, "{}: {storage} storage bindings", key.name());
        seen.insert(key.path);
    }
    // Row sources are definitions of the ring kernels; files included by others are parts of those.
    let defined: HashSet<String> = kernels().into_iter().flat_map(|key| key.definitions.into_values()).collect();
    let is_included =
        |path: &str| source::files().any(|other| source::file(other).unwrap().contains(&format!("include {path}")));
    // Texts of surfaces are definitions, in which the host has written numbers.
    let first_line = |text: &'static str| text.lines().next().unwrap_or_default();
    let is_text = |path: &str| defined.iter().any(|text| text.starts_with(first_line(source::file(path).unwrap())));
    let is_seen = |path: &str| seen.contains(path) || defined.contains(path) || is_included(path) || is_text(path);
    let unseen: Vec<_> = source::files().filter(|path| !is_seen(path)).collect();
    assert!(unseen.is_empty(), "no kernel is made of {unseen:?}: add it to the catalogue");
}

#[test]
fn every_barrier_and_shuffle_stands_in_uniform_control_flow() {
    for key in kernels() {
        let faults = faults(&key.wgsl(), key.entry);
        assert!(faults.is_empty(), "{}: {faults:?}", key.name());
    }
}

#[test]
fn the_lint_finds_what_it_is_for() {
    let head = "var<workgroup> w: array<f32, 64>;\n@group(0) @binding(0) var<storage, read_write> x: array<f32>;\n\
                @compute @workgroup_size(64) fn main(@builtin(local_invocation_index) i: u32) {\n";
    let found = |body: &str| faults(&format!("{head}{body}}} fn wait() {{ workgroupBarrier(); }}"), "main");
    assert_eq!(found("if (i < 3u) { workgroupBarrier(); }"), ["barrier in divergent control flow"]);
    assert_eq!(found("if (i < 3u) { return; } workgroupBarrier();"), ["barrier after a divergent return"]);
    assert_eq!(found("for (var k = 0u; k < i; k++) { workgroupBarrier(); }"), ["barrier in divergent control flow"]);
    assert_eq!(found("if (i < 3u) { wait(); }"), ["barrier in divergent control flow"]);
    assert_eq!(found("if (i < 3u) { return; } wait();"), ["barrier after a divergent return"]);
    assert_eq!(found("let a = x[i]; if (a != a) { x[i] = 0.0; }"), ["x != x or x == x, which is no test for NaN"]);
    assert_eq!(found("if (x[i] == x[i]) { x[i] = 0.0; }"), ["x != x or x == x, which is no test for NaN"]);
    assert!(
        found("for (var k = 1u; k < 64u; k *= 2u) { w[i] = x[i]; workgroupBarrier(); x[i] = w[0]; wait(); }")
            .is_empty()
    );
}

fn faults(wgsl: &str, entry: &str) -> Vec<&'static str> {
    let (module, _) = parse("lint", wgsl).unwrap_or_else(|error| panic!("{error}"));
    let function = &module.entry_points.iter().find(|point| point.name == entry).expect("the entry point").function;
    let mut walk = Walk { module: &module, function, faults: Vec::new(), returned: false };
    walk.block(&function.body, true);
    let functions = module.functions.iter().map(|(_, function)| function).chain([function]);
    if functions.into_iter().any(compares_with_itself) {
        walk.faults.push("x != x or x == x, which is no test for NaN");
    }
    walk.faults
}

/// Walks an entry point, knowing whether all threads of the workgroup walk with it.
struct Walk<'a> {
    module: &'a Module,
    function: &'a Function,
    faults: Vec<&'static str>,
    returned: bool,
}

impl Walk<'_> {
    fn block(&mut self, block: &Block, uniform: bool) {
        for statement in block {
            match statement {
                Statement::ControlBarrier(_)
                | Statement::SubgroupBallot { .. }
                | Statement::SubgroupGather { .. }
                | Statement::SubgroupCollectiveOperation { .. } => {
                    if !uniform {
                        self.faults.push("barrier in divergent control flow");
                    }
                    if self.returned {
                        self.faults.push("barrier after a divergent return");
                    }
                }
                Statement::Block(inner) => self.block(inner, uniform),
                Statement::If { condition, accept, reject } => {
                    let uniform = uniform && self.is_uniform(*condition, &mut Vec::new());
                    self.block(accept, uniform);
                    self.block(reject, uniform);
                }
                Statement::Switch { selector, cases } => {
                    let uniform = uniform && self.is_uniform(*selector, &mut Vec::new());
                    cases.iter().for_each(|case| self.block(&case.body, uniform));
                }
                Statement::Loop { body, continuing, break_if } => {
                    let breaks = break_if.iter().copied().chain(break_conditions(body));
                    let uniform = uniform && breaks.into_iter().all(|c| self.is_uniform(c, &mut Vec::new()));
                    self.block(body, uniform);
                    self.block(continuing, uniform);
                }
                Statement::Call { function, .. } => self.call(&self.module.functions[*function], uniform),
                Statement::Return { .. } if !uniform => self.returned = true,
                _ => {}
            }
        }
    }

    /// A function's body, in which the arguments are not known to be the same for all threads.
    fn call(&mut self, function: &Function, uniform: bool) {
        let mut walk = Walk { module: self.module, function, faults: Vec::new(), returned: self.returned };
        walk.block(&function.body, uniform);
        self.faults.extend(walk.faults);
    }

    /// Whether an expression is the same for all threads of a workgroup, as far as a simple look
    /// can tell.
    fn is_uniform(&self, expression: Handle<Expression>, under_way: &mut Vec<Handle<LocalVariable>>) -> bool {
        let mut all = |parts: &[Handle<Expression>]| parts.iter().all(|&part| self.is_uniform(part, under_way));
        match self.function.expressions[expression] {
            Expression::Literal(_) | Expression::Constant(_) | Expression::Override(_) | Expression::ZeroValue(_) => {
                true
            }
            Expression::Binary { left, right, .. } => all(&[left, right]),
            Expression::Unary { expr, .. } | Expression::As { expr, .. } => all(&[expr]),
            Expression::AccessIndex { base, .. } => all(&[base]),
            Expression::FunctionArgument(index) => matches!(
                self.function.arguments[index as usize].binding,
                Some(Binding::BuiltIn(BuiltIn::WorkGroupId | BuiltIn::NumWorkGroups))
            ),
            Expression::GlobalVariable(variable) => {
                self.module.global_variables[variable].space == AddressSpace::Uniform
            }
            Expression::Load { pointer } => match self.function.expressions[pointer] {
                Expression::LocalVariable(variable) => self.is_uniform_variable(variable, under_way),
                _ => self.is_uniform(pointer, under_way),
            },
            _ => false,
        }
    }

    fn is_uniform_variable(&self, variable: Handle<LocalVariable>, under_way: &mut Vec<Handle<LocalVariable>>) -> bool {
        if under_way.contains(&variable) {
            return true;
        }
        under_way.push(variable);
        let mut values: Vec<_> = self.function.local_variables[variable].init.into_iter().collect();
        stores(&self.function.body, &mut |pointer, value| {
            if matches!(self.function.expressions[pointer], Expression::LocalVariable(v) if v == variable) {
                values.push(value);
            }
        });
        values.into_iter().all(|value| self.is_uniform(value, under_way))
    }
}

/// The conditions under which a loop's body breaks.
fn break_conditions(body: &Block) -> Vec<Handle<Expression>> {
    let breaks = |block: &Block| block.iter().any(|s| matches!(s, Statement::Break));
    body.iter()
        .filter_map(|statement| match statement {
            Statement::If { condition, accept, reject } if breaks(accept) || breaks(reject) => Some(*condition),
            _ => None,
        })
        .collect()
}

fn stores(block: &Block, each: &mut impl FnMut(Handle<Expression>, Handle<Expression>)) {
    for statement in block {
        match statement {
            Statement::Store { pointer, value } => each(*pointer, *value),
            Statement::Block(inner) => stores(inner, each),
            Statement::If { accept, reject, .. } => {
                stores(accept, each);
                stores(reject, each);
            }
            Statement::Switch { cases, .. } => cases.iter().for_each(|case| stores(&case.body, each)),
            Statement::Loop { body, continuing, .. } => {
                stores(body, each);
                stores(continuing, each);
            }
            _ => {}
        }
    }
}

fn compares_with_itself(function: &Function) -> bool {
    function.expressions.iter().any(|(_, expression)| match expression {
        Expression::Binary { op: naga::BinaryOperator::NotEqual | naga::BinaryOperator::Equal, left, right } => {
            same(function, *left, *right)
        }
        _ => false,
    })
}

/// Whether two expressions read the same thing.
fn same(function: &Function, a: Handle<Expression>, b: Handle<Expression>) -> bool {
    if a == b {
        return true;
    }
    match (&function.expressions[a], &function.expressions[b]) {
        (Expression::Load { pointer: a }, Expression::Load { pointer: b }) => same(function, *a, *b),
        (Expression::Access { base: a, index: i }, Expression::Access { base: b, index: j }) => {
            same(function, *a, *b) && same(function, *i, *j)
        }
        (Expression::AccessIndex { base: a, index: i }, Expression::AccessIndex { base: b, index: j }) => {
            i == j && same(function, *a, *b)
        }
        (Expression::GlobalVariable(a), Expression::GlobalVariable(b)) => a == b,
        (Expression::LocalVariable(a), Expression::LocalVariable(b)) => a == b,
        _ => false,
    }
}
