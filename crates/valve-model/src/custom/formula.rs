//! A small formula language: numbers, names, + - * / ^, parentheses, the usual
//! functions and table(z, from, to, k0, k1, ...) for straight lines between knots, with the precedence of mathematics (-2^2 is -4, 2^3^2 is
//! 2^(3^2)) and numbers such as 1e-3.
//!
//! A formula is parsed once into a postfix program that runs on any [`Real`].

use crate::real::Real;

/// The names that every formula may use, in the order of [`Variables`].
pub const VARIABLE_NAMES: [&str; 8] = ["x", "v", "p_t", "p_p", "p_s", "p_atm", "t_since_command", "L"];

const FUNCTIONS: [(&str, Function); 11] = [
    ("exp", Function::Exp),
    ("log", Function::Ln),
    ("ln", Function::Ln),
    ("sqrt", Function::Sqrt),
    ("abs", Function::Abs),
    ("sin", Function::Sin),
    ("cos", Function::Cos),
    ("tanh", Function::Tanh),
    ("sign", Function::Sign),
    ("min", Function::Min),
    ("max", Function::Max),
];

/// The deepest nesting of intermediate results that a formula may need.
const MAX_DEPTH: usize = 32;

/// As deep as most formulas are; a shallow stack takes less time to clear.
const USUAL_DEPTH: usize = 6;

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
    Min,
    Max,
}

impl Function {
    fn arity(self) -> usize {
        if matches!(self, Self::Min | Self::Max) { 2 } else { 1 }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Op {
    Number(f64),
    Variable(usize),
    Parameter(usize),
    Negate,
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    /// A power of two, which most formulas have.
    Square,
    Call(Function),
    /// Straight lines between this many knots.
    Table(usize),
    /// The same where the knots are parameters that follow each other: the first, and how many.
    TableOfParameters(usize, usize),
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
    program: Vec<Op>,
    /// How many intermediate results wait at most.
    depth: usize,
}

impl Formula {
    /// Parses a formula that may use the variables and these parameter names.
    pub fn parse(source: &str, parameters: &[&str]) -> Result<Self, FormulaError> {
        let mut parser = Parser { source, rest: 0, parameters, program: Vec::new(), depth: 0 };
        for (index, name) in parameters.iter().enumerate() {
            let clash = *name == "table"
                || VARIABLE_NAMES.contains(name)
                || FUNCTIONS.iter().any(|(function, _)| function == name);
            if clash || parameters[..index].contains(name) {
                return Err(parser.error(0, format!("a parameter named {name}"), "a name that is not yet taken"));
            }
        }
        parser.sum()?;
        parser.skip_space();
        if parser.rest < source.len() {
            return Err(parser.unexpected("an operator or the end"));
        }
        let depth = deepest(&parser.program);
        Ok(Self { source: source.to_owned(), program: parser.program, depth })
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
        self.program.iter().any(|op| matches!(op, Op::Variable(index) if Some(*index) == time))
    }

    /// The value of the formula, with the parameters in the order they were named.
    #[inline(always)]
    #[must_use]
    pub fn evaluate<R: Real>(&self, variables: &Variables<'_, R>, parameters: &[R]) -> R {
        if self.depth <= USUAL_DEPTH {
            self.evaluate_on::<R, USUAL_DEPTH>(variables, parameters)
        } else {
            self.evaluate_on::<R, MAX_DEPTH>(variables, parameters)
        }
    }

    #[inline(always)]
    fn evaluate_on<R: Real, const DEPTH: usize>(&self, variables: &Variables<'_, R>, parameters: &[R]) -> R {
        let mut stack = [R::splat(0.0); DEPTH];
        let mut top = 0;
        for op in &self.program {
            match *op {
                Op::Number(value) => push(&mut stack, &mut top, R::splat(value)),
                Op::Variable(index) => push(&mut stack, &mut top, *variables.values[index]),
                Op::Parameter(index) => push(&mut stack, &mut top, parameters[index]),
                Op::Negate => stack[top - 1] = -stack[top - 1],
                Op::Square => stack[top - 1] = stack[top - 1] * stack[top - 1],
                Op::Call(function) if function.arity() == 1 => stack[top - 1] = call(function, stack[top - 1]),
                Op::Table(knots) => {
                    top -= knots + 2;
                    let (z, bounds) = (stack[top - 1], (stack[top], stack[top + 1]));
                    stack[top - 1] = look_up(z, bounds, &stack[top + 2..top + 2 + knots]);
                }
                Op::TableOfParameters(first, knots) => {
                    top -= 2;
                    let (z, bounds) = (stack[top - 1], (stack[top], stack[top + 1]));
                    stack[top - 1] = look_up(z, bounds, &parameters[first..first + knots]);
                }
                _ => {
                    top -= 1;
                    stack[top - 1] = combine(*op, stack[top - 1], stack[top]);
                }
            }
        }
        stack[0]
    }
}

/// The height of the stack after each operation of a program, highest.
fn deepest(program: &[Op]) -> usize {
    let mut height = 0;
    let mut highest = 0;
    for op in program {
        height = match op {
            Op::Number(_) | Op::Variable(_) | Op::Parameter(_) => height + 1,
            Op::Negate | Op::Square => height,
            Op::Call(function) => height + 1 - function.arity(),
            Op::Table(knots) => height - knots - 2,
            Op::TableOfParameters(..) => height - 2,
            _ => height - 1,
        };
        highest = highest.max(height);
    }
    highest
}

/// The value of table(z, from, to, k0, k1, ...): even knots from `from` to `to`, held beyond them.
#[inline(always)]
fn look_up<R: Real>(z: R, (from, to): (R, R), knots: &[R]) -> R {
    let (zero, one) = (R::splat(0.0), R::splat(1.0));
    let last = knots.len() - 1;
    let at = ((z - from) / (to - from)).max(zero).min(one) * R::splat(last as f64);
    // Each piece adds as much of its rise as lies behind z, so that no lane has to choose a knot.
    let mut sum = knots[0];
    for (left, pair) in knots.windows(2).enumerate() {
        let passed = (at - R::splat(left as f64)).max(zero).min(one);
        sum = passed.mul_add(pair[1] - pair[0], sum);
    }
    sum
}

#[inline(always)]
fn push<R: Real>(stack: &mut [R], top: &mut usize, value: R) {
    stack[*top] = value;
    *top += 1;
}

#[inline(always)]
fn call<R: Real>(function: Function, a: R) -> R {
    match function {
        Function::Exp => a.exp(),
        Function::Ln => a.map(libm::log),
        Function::Sqrt => a.sqrt(),
        Function::Sin => a.map(libm::sin),
        Function::Cos => a.map(libm::cos),
        Function::Tanh => a.map(libm::tanh),
        Function::Sign => a.map(|value| if value == 0.0 { 0.0 } else { value.signum() }),
        Function::Abs | Function::Min | Function::Max => a.abs(),
    }
}

#[inline(always)]
fn combine<R: Real>(op: Op, a: R, b: R) -> R {
    match op {
        Op::Add => a + b,
        Op::Subtract => a - b,
        Op::Multiply => a * b,
        Op::Divide => a / b,
        Op::Call(Function::Min) => a.min(b),
        Op::Call(_) => a.max(b),
        _ => a.zip(b, |base, exponent| if exponent == 2.0 { base * base } else { libm::pow(base, exponent) }),
    }
}

struct Parser<'a> {
    source: &'a str,
    rest: usize,
    parameters: &'a [&'a str],
    program: Vec<Op>,
    depth: usize,
}

impl Parser<'_> {
    /// sum := product (("+" | "-") product)*
    fn sum(&mut self) -> Result<(), FormulaError> {
        self.product()?;
        loop {
            let op = match self.peek() {
                Some('+') => Op::Add,
                Some('-') => Op::Subtract,
                _ => return Ok(()),
            };
            self.rest += 1;
            self.product()?;
            self.emit(op)?;
        }
    }

    /// product := signed (("*" | "/") signed)*
    fn product(&mut self) -> Result<(), FormulaError> {
        self.signed()?;
        loop {
            let op = match self.peek() {
                Some('*') => Op::Multiply,
                Some('/') => Op::Divide,
                _ => return Ok(()),
            };
            self.rest += 1;
            self.signed()?;
            self.emit(op)?;
        }
    }

    /// signed := ("-" | "+") signed | power; the sign binds weaker than a power.
    fn signed(&mut self) -> Result<(), FormulaError> {
        match self.peek() {
            Some('-') => {
                self.nested(Self::signed)?;
                self.emit(Op::Negate)
            }
            Some('+') => self.nested(Self::signed),
            _ => self.power(),
        }
    }

    /// power := atom ("^" signed)?; from right to left.
    fn power(&mut self) -> Result<(), FormulaError> {
        self.atom()?;
        if self.peek() == Some('^') {
            self.nested(Self::signed)?;
            self.emit(Op::Power)?;
        }
        Ok(())
    }

    /// atom := number | name | name "(" sum ("," sum)* ")" | "(" sum ")"
    fn atom(&mut self) -> Result<(), FormulaError> {
        match self.peek() {
            Some('(') => {
                self.nested(Self::sum)?;
                self.expect(')')
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_ascii_alphabetic() || c == '_' => self.name(),
            _ => Err(self.unexpected("a number, a name or \"(\"")),
        }
    }

    fn number(&mut self) -> Result<(), FormulaError> {
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
                self.emit(Op::Number(value))
            }
            _ => Err(self.error(self.rest, format!("\"{}\"", &text[..end]), "a number such as 2.5 or 1e-3")),
        }
    }

    fn name(&mut self) -> Result<(), FormulaError> {
        let start = self.rest;
        let text = &self.source[start..];
        let end = text.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(text.len());
        let name = &text[..end];
        self.rest += end;
        if let Some(index) = self.parameters.iter().position(|parameter| *parameter == name) {
            return self.emit(Op::Parameter(index));
        }
        if let Some(index) = VARIABLE_NAMES.iter().position(|variable| *variable == name) {
            return self.emit(Op::Variable(index));
        }
        if name == "table" {
            return self.table();
        }
        if let Some((_, function)) = FUNCTIONS.iter().find(|(known, _)| *known == name) {
            self.expect('(')?;
            self.rest -= 1;
            self.nested(Self::sum)?;
            for _ in 1..function.arity() {
                self.expect(',')?;
                self.sum()?;
            }
            self.expect(')')?;
            return self.emit(Op::Call(*function));
        }
        let known: Vec<&str> = VARIABLE_NAMES.iter().chain(self.parameters).copied().collect();
        Err(self.error(start, format!("\"{name}\""), &format!("a function or one of {}", known.join(", "))))
    }

    /// table := "table" "(" sum "," sum "," sum "," sum ("," sum)+ ")"
    fn table(&mut self) -> Result<(), FormulaError> {
        self.expect('(')?;
        self.rest -= 1;
        self.nested(Self::sum)?;
        let mut arguments = 1;
        while self.peek() == Some(',') || arguments < 5 {
            self.expect(',')?;
            self.sum()?;
            arguments += 1;
        }
        self.expect(')')?;
        self.emit(Op::Table(arguments - 3))
    }

    /// Steps over one character, then parses one level deeper.
    fn nested(&mut self, parse: fn(&mut Self) -> Result<(), FormulaError>) -> Result<(), FormulaError> {
        self.rest += 1;
        self.depth += 1;
        if self.depth > 200 {
            return Err(self.unexpected("a formula nested less deeply"));
        }
        parse(self)?;
        self.depth -= 1;
        Ok(())
    }

    fn emit(&mut self, op: Op) -> Result<(), FormulaError> {
        match op {
            Op::Power if self.program.last() == Some(&Op::Number(2.0)) => {
                self.program.pop();
                self.program.push(Op::Square);
            }
            Op::Table(knots) => {
                let start = self.program.len() - knots;
                let first = self.parameters_in_a_row(start);
                if first.is_some() {
                    self.program.truncate(start);
                }
                self.program.push(first.map_or(op, |first| Op::TableOfParameters(first, knots)));
            }
            _ => self.program.push(op),
        }
        if deepest(&self.program) > MAX_DEPTH {
            return Err(self.unexpected("a formula with fewer pending operations"));
        }
        Ok(())
    }

    /// The first parameter, where the program from `start` on takes parameters that follow each other.
    fn parameters_in_a_row(&self, start: usize) -> Option<usize> {
        let Op::Parameter(first) = self.program[start] else { return None };
        let follow = |(offset, op): (usize, &Op)| *op == Op::Parameter(first + offset);
        self.program[start..].iter().enumerate().all(follow).then_some(first)
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
        Formula::parse(formula, &["a", "b"]).unwrap().evaluate(&variables, &[3.0, 7.0])
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
        assert!(Formula::parse(&"(".repeat(100_000), &[]).is_err());
    }
}
