//! A small formula language: numbers, names, + - * / ^, parentheses, the usual functions and
//! table(z, from, to, k0, k1, ...) for straight lines between knots, with the precedence of mathematics
//! (-2^2 is -4, 2^3^2 is 2^(3^2)) and numbers such as 1e-3.
//!
//! A formula is parsed once into a program that runs on any [`Real`]: each step changes the result at hand, or
//! puts it aside for later.

use crate::real::Real;

/// The names that every formula may use, in the order of [`Variables`].
pub const VARIABLE_NAMES: [&str; 8] = ["x", "v", "p_t", "p_p", "p_s", "p_atm", "t_since_command", "L"];

const FUNCTIONS: [(&str, Function); 9] = [
    ("exp", Function::Exp),
    ("log", Function::Ln),
    ("ln", Function::Ln),
    ("sqrt", Function::Sqrt),
    ("abs", Function::Abs),
    ("sin", Function::Sin),
    ("cos", Function::Cos),
    ("tanh", Function::Tanh),
    ("sign", Function::Sign),
];

const FUNCTIONS_OF_TWO: [(&str, Pair); 2] = [("min", Pair::Min), ("max", Pair::Max)];

/// The longest formula, characters: what is parsed is taken apart by recursion.
const LONGEST: usize = 4000;

/// The most intermediate results that may wait.
const MAX_DEPTH: usize = 32;

/// As many as wait in most formulas; a shallow stack takes less time to clear.
const USUAL_DEPTH: usize = 4;

/// Values of the variables of a formula, SI.
#[derive(Debug, Clone, Copy)]
pub struct Variables<'a, R> {
    /// Position x, velocity v, chamber pressure, pipe pressure, supply pressure, ambient pressure,
    /// time since the last command edge, stroke; in the order of the names.
    pub values: [&'a R; VARIABLE_NAMES.len()],
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Function {
    Exp,
    Ln,
    Sqrt,
    Abs,
    Sin,
    Cos,
    Tanh,
    Sign,
}

/// What stands in a formula as it is.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Leaf {
    Variable(usize),
    /// One of the operands: parameters, then the numbers of the formula.
    Operand(usize),
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Pair {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Min,
    Max,
}

/// A formula as it was parsed.
#[derive(Debug, Clone, PartialEq)]
enum Tree {
    Leaf(Leaf),
    Negate(Box<Tree>),
    Square(Box<Tree>),
    Call(Function, Box<Tree>),
    Pair(Pair, Box<[Tree; 2]>),
    /// table(z, from, to, knots)
    Table(Box<[Tree; 3]>, Vec<Tree>),
}

/// A step of a program. The result at hand is what the steps before it gave.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Op {
    /// A leaf becomes the result.
    Load(Leaf),
    /// The result is put aside, on a stack.
    Wait,
    Negate,
    Square,
    Call(Function),
    /// The result, and a leaf to its right.
    WithRight(Pair, Leaf),
    /// A leaf, and the result to its right.
    WithLeft(Pair, Leaf),
    /// What waits last, and the result to its right.
    WithWaiting(Pair),
    /// Straight lines between this many knots: z, from, to and all knots but the last wait.
    Table(usize),
    /// The same with operands for the bounds and operands that follow each other for the knots: from, to, the
    /// first knot and how many.
    TableOfOperands(usize, usize, usize, usize),
}

/// A formula that was refused, and where.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("formula \"{formula}\", character {position}: found {found}, expected {expected}")]
pub struct FormulaError {
    /// The whole formula.
    pub formula: String,
    /// Position of the trouble, characters counted from 1.
    pub position: usize,
    /// What stands there.
    pub found: String,
    /// What would be right.
    pub expected: String,
}

/// A parsed formula.
#[derive(Debug, Clone, PartialEq)]
pub struct Formula {
    source: String,
    /// The numbers in it.
    numbers: Vec<f64>,
    program: Vec<Op>,
    /// How many intermediate results wait at most.
    depth: usize,
}

impl Formula {
    /// Parses a formula that may use the variables and these parameter names.
    pub fn parse(source: &str, parameters: &[&str]) -> Result<Self, FormulaError> {
        let mut parser = Parser { source, rest: 0, parameters, numbers: Vec::new(), depth: 0 };
        for (index, name) in parameters.iter().enumerate() {
            let functions = FUNCTIONS.map(|(function, _)| function);
            let clash = *name == "table"
                || VARIABLE_NAMES.contains(name)
                || functions.contains(name)
                || FUNCTIONS_OF_TWO.iter().any(|(function, _)| function == name);
            if clash || parameters[..index].contains(name) {
                return Err(parser.error(0, format!("a parameter named {name}"), "a name that is not yet taken"));
            }
        }
        if source.len() > LONGEST {
            let found = format!("{} characters", source.chars().count());
            return Err(parser.error(0, found, &format!("a formula of at most {LONGEST}")));
        }
        let tree = parser.sum()?;
        parser.skip_space();
        if parser.rest < source.len() {
            return Err(parser.unexpected("an operator or the end"));
        }
        let mut program = Vec::new();
        tree.emit(&mut program);
        let depth = most_waiting(&program);
        if depth > MAX_DEPTH {
            return Err(parser.unexpected("a formula with fewer pending operations"));
        }
        Ok(Self { source: source.to_owned(), numbers: parser.numbers, program, depth })
    }

    /// The formula as it was written.
    #[must_use]
    pub fn source(&self) -> &str {
        &self.source
    }

    /// Whether its value changes with time alone, while the valve rests.
    #[must_use]
    pub fn depends_on_time(&self) -> bool {
        let time = VARIABLE_NAMES.iter().position(|name| *name == "t_since_command");
        self.program.iter().any(|op| match op {
            Op::Load(leaf) | Op::WithRight(_, leaf) | Op::WithLeft(_, leaf) => {
                matches!(leaf, Leaf::Variable(index) if Some(*index) == time)
            }
            _ => false,
        })
    }

    /// What it is evaluated with: the values of the parameters, in the order they were named, then its numbers.
    #[must_use]
    pub fn operands(&self, parameters: impl IntoIterator<Item = f64>) -> Vec<f64> {
        parameters.into_iter().chain(self.numbers.iter().copied()).collect()
    }

    /// The value of the formula, with its operands (see [`Formula::operands`]).
    #[inline(always)]
    #[must_use]
    pub fn evaluate<R: Real>(&self, variables: &Variables<'_, R>, operands: &[R]) -> R {
        if self.depth < USUAL_DEPTH {
            self.evaluate_on::<R, USUAL_DEPTH>(variables, operands)
        } else {
            self.evaluate_on::<R, { MAX_DEPTH + 1 }>(variables, operands)
        }
    }

    #[inline(always)]
    fn evaluate_on<R: Real, const DEPTH: usize>(&self, variables: &Variables<'_, R>, operands: &[R]) -> R {
        // The result stands behind those that wait. It is changed in place: values that meet behind a choice
        // would be taken out of their wide registers.
        let mut stack = [R::splat(0.0); DEPTH];
        let mut top = 0;
        for op in &self.program {
            match *op {
                Op::Load(leaf) => stack[top] = *value(leaf, variables, operands),
                Op::Wait => top += 1,
                Op::Negate => stack[top] = -stack[top],
                Op::Square => stack[top] = stack[top] * stack[top],
                Op::Call(function) => call(function, &mut stack[top]),
                Op::WithRight(pair, leaf) => combine(pair, &mut stack[top], value(leaf, variables, operands)),
                Op::WithLeft(pair, leaf) => combine_reversed(pair, &mut stack[top], value(leaf, variables, operands)),
                Op::WithWaiting(pair) => {
                    let (waiting, result) = stack.split_at_mut(top);
                    top -= 1;
                    combine(pair, &mut waiting[top], &result[0]);
                }
                Op::Table(knots) => {
                    top -= knots + 2;
                    let (z, rest) = stack[top..].split_at_mut(1);
                    look_up(&mut z[0], &rest[0], &rest[1], &rest[2..2 + knots]);
                }
                Op::TableOfOperands(from, to, first, knots) => {
                    look_up(&mut stack[top], &operands[from], &operands[to], &operands[first..first + knots]);
                }
            }
        }
        stack[0]
    }
}

impl Tree {
    /// Appends the steps whose result is this tree's.
    fn emit(&self, program: &mut Vec<Op>) {
        let after = |tree: &Self, op: Op, program: &mut Vec<Op>| {
            tree.emit(program);
            program.push(op);
        };
        match self {
            Self::Leaf(leaf) => program.push(Op::Load(*leaf)),
            Self::Negate(tree) => after(tree, Op::Negate, program),
            Self::Square(tree) => after(tree, Op::Square, program),
            Self::Call(function, tree) => after(tree, Op::Call(*function), program),
            Self::Pair(pair, sides) => match &**sides {
                [left, Self::Leaf(right)] => after(left, Op::WithRight(*pair, *right), program),
                [Self::Leaf(left), right] => after(right, Op::WithLeft(*pair, *left), program),
                [left, right] => {
                    after(left, Op::Wait, program);
                    after(right, Op::WithWaiting(*pair), program);
                }
            },
            Self::Table(place, knots) => match (&**place, operands_in_a_row(knots)) {
                ([z, Self::Leaf(Leaf::Operand(from)), Self::Leaf(Leaf::Operand(to))], Some(first)) => {
                    after(z, Op::TableOfOperands(*from, *to, first, knots.len()), program);
                }
                (place, _) => {
                    let mut all: Vec<&Self> = place.iter().chain(knots).collect();
                    if let Some(last) = all.pop() {
                        for tree in all {
                            after(tree, Op::Wait, program);
                        }
                        after(last, Op::Table(knots.len()), program);
                    }
                }
            },
        }
    }
}

/// The first operand, where all trees are operands that follow each other.
fn operands_in_a_row(trees: &[Tree]) -> Option<usize> {
    let Some(Tree::Leaf(Leaf::Operand(first))) = trees.first() else { return None };
    let follow = |(offset, tree): (usize, &Tree)| *tree == Tree::Leaf(Leaf::Operand(first + offset));
    trees.iter().enumerate().all(follow).then_some(*first)
}

/// How many results wait at most while a program runs.
fn most_waiting(program: &[Op]) -> usize {
    let mut count = 0;
    let mut most = 0;
    for op in program {
        match op {
            Op::Wait => count += 1,
            Op::WithWaiting(_) => count -= 1,
            Op::Table(knots) => {
                // The last knot joins those that wait.
                most = most.max(count + 1);
                count -= knots + 2;
            }
            _ => {}
        }
        most = most.max(count);
    }
    most
}

#[inline(always)]
fn value<'a, R: Real>(leaf: Leaf, variables: &Variables<'a, R>, operands: &'a [R]) -> &'a R {
    match leaf {
        Leaf::Variable(index) => variables.values[index],
        Leaf::Operand(index) => &operands[index],
    }
}

/// The value of table(z, from, to, k0, k1, ...), in place of z: even knots from `from` to `to`, held beyond them.
#[inline(always)]
fn look_up<R: Real>(z: &mut R, from: &R, to: &R, knots: &[R]) {
    let (zero, one) = (R::splat(0.0), R::splat(1.0));
    let last = knots.len() - 1;
    let at = ((*z - *from) / (*to - *from)).max(zero).min(one) * R::splat(last as f64);
    // Each piece adds as much of its rise as lies behind z, so that no lane has to choose a knot.
    let mut sum = knots[0];
    for (left, pair) in knots.windows(2).enumerate() {
        let passed = (at - R::splat(left as f64)).max(zero).min(one);
        sum = passed.mul_add(pair[1] - pair[0], sum);
    }
    *z = sum;
}

#[inline(always)]
fn call<R: Real>(function: Function, a: &mut R) {
    match function {
        Function::Exp => *a = a.exp(),
        Function::Ln => *a = a.map(libm::log),
        Function::Sqrt => *a = a.sqrt(),
        Function::Sin => *a = a.map(libm::sin),
        Function::Cos => *a = a.map(libm::cos),
        Function::Tanh => *a = a.map(libm::tanh),
        Function::Sign => *a = a.map(|value| if value == 0.0 { 0.0 } else { value.signum() }),
        Function::Abs => *a = a.abs(),
    }
}

/// a becomes "a pair b".
#[inline(always)]
fn combine<R: Real>(pair: Pair, a: &mut R, b: &R) {
    match pair {
        Pair::Add => *a = *a + *b,
        Pair::Subtract => *a = *a - *b,
        Pair::Multiply => *a = *a * *b,
        Pair::Divide => *a = *a / *b,
        Pair::Min => *a = a.min(*b),
        Pair::Max => *a = a.max(*b),
        Pair::Power => *a = a.zip(*b, power),
    }
}

/// a becomes "b pair a".
#[inline(always)]
fn combine_reversed<R: Real>(pair: Pair, a: &mut R, b: &R) {
    match pair {
        Pair::Add => *a = *b + *a,
        Pair::Subtract => *a = *b - *a,
        Pair::Multiply => *a = *b * *a,
        Pair::Divide => *a = *b / *a,
        Pair::Min => *a = b.min(*a),
        Pair::Max => *a = b.max(*a),
        Pair::Power => *a = b.zip(*a, power),
    }
}

fn power(base: f64, exponent: f64) -> f64 {
    if exponent == 2.0 { base * base } else { libm::pow(base, exponent) }
}

/// Two trees in one.
fn pair(pair: Pair, left: Tree, right: Tree) -> Tree {
    Tree::Pair(pair, Box::new([left, right]))
}

struct Parser<'a> {
    source: &'a str,
    rest: usize,
    parameters: &'a [&'a str],
    numbers: Vec<f64>,
    depth: usize,
}

impl Parser<'_> {
    /// sum := product (("+" | "-") product)*
    fn sum(&mut self) -> Result<Tree, FormulaError> {
        let mut left = self.product()?;
        loop {
            let op = match self.peek() {
                Some('+') => Pair::Add,
                Some('-') => Pair::Subtract,
                _ => return Ok(left),
            };
            self.rest += 1;
            left = pair(op, left, self.product()?);
        }
    }

    /// product := signed (("*" | "/") signed)*
    fn product(&mut self) -> Result<Tree, FormulaError> {
        let mut left = self.signed()?;
        loop {
            let op = match self.peek() {
                Some('*') => Pair::Multiply,
                Some('/') => Pair::Divide,
                _ => return Ok(left),
            };
            self.rest += 1;
            left = pair(op, left, self.signed()?);
        }
    }

    /// signed := ("-" | "+") signed | power; the sign binds weaker than a power.
    fn signed(&mut self) -> Result<Tree, FormulaError> {
        match self.peek() {
            Some('-') => Ok(Tree::Negate(Box::new(self.nested(Self::signed)?))),
            Some('+') => self.nested(Self::signed),
            _ => self.power(),
        }
    }

    /// power := atom ("^" signed)?; from right to left.
    fn power(&mut self) -> Result<Tree, FormulaError> {
        let base = self.atom()?;
        if self.peek() != Some('^') {
            return Ok(base);
        }
        let exponent = self.nested(Self::signed)?;
        match exponent {
            Tree::Leaf(leaf) if self.number_at(leaf) == Some(2.0) => Ok(Tree::Square(Box::new(base))),
            _ => Ok(pair(Pair::Power, base, exponent)),
        }
    }

    /// The value of a leaf that is a number.
    fn number_at(&self, leaf: Leaf) -> Option<f64> {
        let Leaf::Operand(index) = leaf else { return None };
        self.numbers.get(index.checked_sub(self.parameters.len())?).copied()
    }

    /// atom := number | name | name "(" sum ("," sum)* ")" | "(" sum ")"
    fn atom(&mut self) -> Result<Tree, FormulaError> {
        match self.peek() {
            Some('(') => {
                let inner = self.nested(Self::sum)?;
                self.expect(')')?;
                Ok(inner)
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_ascii_alphabetic() || c == '_' => self.name(),
            _ => Err(self.unexpected("a number, a name or \"(\"")),
        }
    }

    fn number(&mut self) -> Result<Tree, FormulaError> {
        let text = &self.source[self.rest..];
        let bytes = text.as_bytes();
        let mut end = 0;
        while end < bytes.len() {
            let exponent_sign = matches!(bytes[end], b'+' | b'-') && end > 0 && matches!(bytes[end - 1], b'e' | b'E');
            if !(bytes[end].is_ascii_alphanumeric() || bytes[end] == b'.' || exponent_sign) {
                break;
            }
            end += 1;
        }
        match text[..end].parse::<f64>() {
            Ok(value) if value.is_finite() => {
                self.rest += end;
                self.numbers.push(value);
                Ok(Tree::Leaf(Leaf::Operand(self.parameters.len() + self.numbers.len() - 1)))
            }
            _ => Err(self.error(self.rest, format!("\"{}\"", &text[..end]), "a number such as 2.5 or 1e-3")),
        }
    }

    fn name(&mut self) -> Result<Tree, FormulaError> {
        let start = self.rest;
        let text = &self.source[start..];
        let end = text.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(text.len());
        let name = &text[..end];
        self.rest += end;
        if let Some(index) = self.parameters.iter().position(|parameter| *parameter == name) {
            return Ok(Tree::Leaf(Leaf::Operand(index)));
        }
        if let Some(index) = VARIABLE_NAMES.iter().position(|variable| *variable == name) {
            return Ok(Tree::Leaf(Leaf::Variable(index)));
        }
        if name == "table" {
            return self.table();
        }
        if let Some((_, function)) = FUNCTIONS.iter().find(|(known, _)| *known == name) {
            let argument = self.first_argument()?;
            self.expect(')')?;
            return Ok(Tree::Call(*function, Box::new(argument)));
        }
        if let Some((_, function)) = FUNCTIONS_OF_TWO.iter().find(|(known, _)| *known == name) {
            let left = self.first_argument()?;
            self.expect(',')?;
            let right = self.sum()?;
            self.expect(')')?;
            return Ok(pair(*function, left, right));
        }
        let known: Vec<&str> = VARIABLE_NAMES.iter().chain(self.parameters).copied().collect();
        Err(self.error(start, format!("\"{name}\""), &format!("a function or one of {}", known.join(", "))))
    }

    /// "(" sum
    fn first_argument(&mut self) -> Result<Tree, FormulaError> {
        self.expect('(')?;
        self.rest -= 1;
        self.nested(Self::sum)
    }

    /// table := "table" "(" sum "," sum "," sum "," sum ("," sum)+ ")"
    fn table(&mut self) -> Result<Tree, FormulaError> {
        let z = self.first_argument()?;
        let mut rest = Vec::new();
        while self.peek() == Some(',') || rest.len() < 4 {
            self.expect(',')?;
            rest.push(self.sum()?);
        }
        self.expect(')')?;
        let knots = rest.split_off(2);
        let [from, to] = <[Tree; 2]>::try_from(rest).unwrap_or_else(|_| unreachable!("two bounds are left"));
        Ok(Tree::Table(Box::new([z, from, to]), knots))
    }

    /// Steps over one character, then parses one level deeper.
    fn nested(&mut self, parse: fn(&mut Self) -> Result<Tree, FormulaError>) -> Result<Tree, FormulaError> {
        self.rest += 1;
        self.depth += 1;
        if self.depth > 200 {
            return Err(self.unexpected("a formula nested less deeply"));
        }
        let tree = parse(self)?;
        self.depth -= 1;
        Ok(tree)
    }

    fn skip_space(&mut self) {
        let text = &self.source[self.rest..];
        self.rest += text.len() - text.trim_start().len();
    }

    fn peek(&mut self) -> Option<char> {
        self.skip_space();
        self.source[self.rest..].chars().next()
    }

    fn expect(&mut self, wanted: char) -> Result<(), FormulaError> {
        if self.peek() == Some(wanted) {
            self.rest += 1;
            Ok(())
        } else {
            Err(self.unexpected(&format!("\"{wanted}\"")))
        }
    }

    fn unexpected(&mut self, expected: &str) -> FormulaError {
        let found = self.peek().map_or_else(|| "the end".to_owned(), |c| format!("\"{c}\""));
        self.error(self.rest, found, expected)
    }

    fn error(&self, at: usize, found: String, expected: &str) -> FormulaError {
        FormulaError {
            formula: self.source.to_owned(),
            position: self.source[..at].chars().count() + 1,
            found,
            expected: expected.to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(formula: &str) -> f64 {
        let values = [0.5, -0.25, 4e5, 5e5, 6e5, 1e5, 0.125, 0.0254];
        let variables = Variables { values: values.each_ref() };
        {
            let formula = Formula::parse(formula, &["a", "b"]).unwrap();
            formula.evaluate(&variables, &formula.operands([3.0, 7.0]))
        }
    }

    #[test]
    fn precedence_is_that_of_mathematics() {
        for (formula, expected) in [
            ("-2^2", -4.0),
            ("2^3^2", 512.0),
            ("2^-1", 0.5),
            ("1 - 2 - 3", -4.0),
            ("8 / 4 / 2", 1.0),
            ("1e-3 + 2.5E+2", 250.001),
            ("-x^2", -0.25),
            ("2 * -a", -6.0),
            ("(a + b) * 2", 20.0),
            ("max(a, b) - min(a, -b)", 14.0),
            ("exp(-(v/0.25)^2)", libm::exp(-1.0)),
            ("sign(v) * abs(v) + sqrt(4)", 1.75),
            ("p_s - p_p - p_atm", 0.0),
            ("1/2", 0.5),
            ("table(x, 0, 1, 10, 20, 40)", 20.0),
            ("1 + table(0.75, 0, 1, 10, 20, 40) * 2", 61.0),
            ("table(v, 0, 1, a, b)", 3.0),
            ("table(x, 0, 1, a, b)", 5.0),
            ("table(x, 0, 2, b, a)", 6.0),
            ("table(x, 1, 0, 10, 20 + a, 40)", 23.0),
            ("2 * (a - 1)^2 + table(7, 0, 1, a, b)", 15.0),
        ] {
            assert!((value(formula) - expected).abs() < 1e-12, "{formula} gave {}", value(formula));
        }
    }

    #[test]
    fn only_the_time_since_a_command_passes_at_rest() {
        let depends = |formula: &str| Formula::parse(formula, &["a"]).unwrap().depends_on_time();
        assert!(depends("a * exp(-t_since_command / 0.2)"));
        assert!(!depends("a * x + v * table(p_p, 0, 1, p_t, L)"));
    }

    #[test]
    fn a_wrong_formula_is_refused_with_the_position() {
        for (formula, position) in [
            ("2 +", 4),
            ("(x", 3),
            ("2 * y", 5),
            ("3 3", 3),
            ("1e", 1),
            ("max(x)", 6),
            ("", 1),
            ("x $ 2", 3),
            ("table(x, 0, 1, 2)", 17),
        ] {
            let error = Formula::parse(formula, &[]).unwrap_err();
            assert_eq!(error.position, position, "{formula}: {error}");
        }
        assert!(Formula::parse("x", &["x"]).is_err());
        for piece in ["(", "x + ", "-", "max(x, "] {
            assert!(Formula::parse(&(piece.repeat(100_000) + "x"), &[]).is_err(), "{piece}");
        }
        let long = "x + ".repeat(900) + "x";
        let sum = Formula::parse(&long, &[]).unwrap();
        assert!((sum.evaluate(&Variables { values: [&1.0; 8] }, &[]) - 901.0).abs() < 1e-9);
    }
}
