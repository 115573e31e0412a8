//! What the list of effects is turned into: constants, the numbers of all of them, and the sums of their terms.

macro_rules! catalogue {
    ($( $(#[$when:meta])* $kind:ident => $module:ident, )*) => {
        $( $(#[$when])* mod $module; )*

        impl EffectKind { $(
            $(#[$when])*
            #[doc = concat!("See `valve effects` and `", stringify!($module), ".rs`.")]
            pub const $kind: Self = Self::of(&$module::INFO);
        )* }

        impl EffectKind {
            /// Every effect of the catalogue, in its order.
            pub const ALL: &'static [Self] = &[ $( $(#[$when])* Self::$kind, )* ];
        }

        /// Which form of its law each effect takes, as bits that it gives a meaning to; 0 is the plainest.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
        pub struct Variants { $( $(#[$when])* pub(crate) $module: u8, )* }

        /// The numbers of all effects, for one valve or for several in lanes, which share the variants.
        #[derive(Debug, Clone, Copy)]
        pub struct Laws<R> {
            $( $(#[$when])* pub(crate) $module: $module::Law<R>, )*
            /// Which forms they take.
            pub(crate) variants: Variants,
        }

        impl Laws<f64> {
            /// None of them.
            pub(crate) fn absent() -> Self {
                Self { $( $(#[$when])* $module: $module::Law::ABSENT, )* variants: Variants::default() }
            }
        }

        impl<R: $crate::real::Real> Laws<R> {
            /// The same valve in every lane.
            pub(crate) fn splat(from: &Laws<f64>) -> Self {
                Self { $( $(#[$when])* $module: $module::Law::splat(&from.$module), )* variants: from.variants }
            }

            /// Puts one valve's numbers into a lane.
            pub(crate) fn set_lane(&mut self, lane: usize, from: &Laws<f64>) {
                $( $(#[$when])* self.$module.set_lane(lane, &from.$module); )*
            }
        }

        // One after the other in the order of the list; see `Term` for what each means.
        impl<R: $crate::real::Real> Laws<R> {
            #[inline(always)]
            pub(crate) fn spring(&self, at: &Moment<'_, R>, force: R) -> R {
                $( $(#[$when])* let force = term::Term::spring(&self.$module, at, force); )*
                force
            }

            #[inline(always)]
            pub(crate) fn force(&self, at: &Moment<'_, R>, sum: R) -> R {
                $( $(#[$when])* let sum = term::Term::force(&self.$module, at, sum); )*
                sum
            }

            #[inline(always)]
            pub(crate) fn damping(&self, at: &Moment<'_, R>, sum: R) -> R {
                $( $(#[$when])* let sum = term::Term::damping(&self.$module, at, sum); )*
                sum
            }

            #[inline(always)]
            pub(crate) fn friction(&self, at: &Moment<'_, R>, sum: R) -> R {
                $( $(#[$when])* let sum = term::Term::friction(&self.$module, at, sum); )*
                sum
            }

            #[inline(always)]
            pub(crate) fn pipe_flow(&self, at: &Moment<'_, R>, sum: R) -> R {
                $( $(#[$when])* let sum = term::Term::pipe_flow(&self.$module, at, sum); )*
                sum
            }

            #[inline(always)]
            pub(crate) fn chamber_flow(&self, at: &Moment<'_, R>, sum: R) -> R {
                $( $(#[$when])* let sum = term::Term::chamber_flow(&self.$module, at, sum); )*
                sum
            }

            #[inline(always)]
            pub(crate) fn vent(&self, difference: R, widest: R, factor: R) -> R {
                $( $(#[$when])* let factor = term::Term::vent(&self.$module, difference, widest, factor); )*
                factor
            }

            #[inline(always)]
            pub(crate) fn line_flow(&self, supply: R, line: R, sum: R) -> R {
                $( $(#[$when])* let sum = term::Term::line_flow(&self.$module, supply, line, sum); )*
                sum
            }

            #[inline(always)]
            pub(crate) fn warm(&self, at: &Moment<'_, R>, flows: &$crate::state::Flows<R>, rate: &mut $crate::state::State<R>) {
                $( $(#[$when])* term::Term::warm(&self.$module, at, flows, rate); )*
            }
        }
    };
}

pub(super) use catalogue;
