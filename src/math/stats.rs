//! Statistics for tests and comparisons: the incomplete gamma function, chi² and corrections for many tests.
//!
//! All in `f64`; arguments outside a function's domain give NaN, never a panic.

/// The error measure of renders: a squared deviation over the square of the right value plus 0.01. Bright values count by their relative
/// error, dark ones by the absolute one.
pub fn relative_square(squared: f64, right: f64) -> f64 {
    squared / (right * right + 0.01)
}

/// The regularised upper incomplete gamma function Q(a, x) = Γ(a, x)/Γ(a), in [0, 1], for a > 0 and x ≥ 0.
///
/// Series below x = a + 1, Lentz' continued fraction above (Numerical Recipes, 3rd edition, section 6.2); relative error about 1e-13
/// while a < 10⁴.
pub fn gamma_q(a: f64, x: f64) -> f64 {
    let in_domain = a > 0.0 && a.is_finite() && x >= 0.0;
    if !in_domain {
        return f64::NAN;
    }
    if x == 0.0 {
        return 1.0;
    }
    if x == f64::INFINITY {
        return 0.0;
    }
    let front = libm::exp(a * libm::log(x) - x - libm::lgamma(a));
    if x < a + 1.0 { 1.0 - front * lower_series(a, x) } else { front * upper_fraction(a, x) }
}

/// The series of γ(a, x)·e^x·x^-a: Σ xⁿ/(a(a+1)…(a+n)).
fn lower_series(a: f64, x: f64) -> f64 {
    let mut term = 1.0 / a;
    let mut sum = term;
    let mut denominator = a;
    // Terms fall by more than x/(x + n) each; the bound is for a of many millions.
    for _ in 0..1_000_000 {
        denominator += 1.0;
        term *= x / denominator;
        sum += term;
        if term < sum * 1e-16 {
            break;
        }
    }
    sum
}

/// The continued fraction of Γ(a, x)·e^x·x^-a, by the modified Lentz method.
fn upper_fraction(a: f64, x: f64) -> f64 {
    const TINY: f64 = 1e-300;
    let mut b = x + 1.0 - a;
    let mut c = 1.0 / TINY;
    let mut d = 1.0 / b;
    let mut h = d;
    for n in 1..1_000_000 {
        let n = f64::from(n);
        let numerator = n * (a - n);
        b += 2.0;
        d = away_from_zero(numerator * d + b, TINY).recip();
        c = away_from_zero(b + numerator / c, TINY);
        let factor = c * d;
        h *= factor;
        if (factor - 1.0).abs() < 1e-15 {
            break;
        }
    }
    h
}

fn away_from_zero(value: f64, tiny: f64) -> f64 {
    if value.abs() < tiny { tiny } else { value }
}

/// The probability that a chi²-distributed value with `degrees_of_freedom` is at least `statistic`.
pub fn chi2_p_value(statistic: f64, degrees_of_freedom: f64) -> f64 {
    gamma_q(0.5 * degrees_of_freedom, 0.5 * statistic)
}

/// Šidák's significance level of one of `tests` independent tests that together raise a false alarm with probability `significance`.
pub fn sidak(significance: f64, tests: u32) -> f64 {
    // 1 - (1 - significance)^(1/tests)
    -libm::expm1(libm::log1p(-significance) / f64::from(tests))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(is: f64, should: f64) {
        assert!((is - should).abs() <= 1e-12 * should.abs(), "{is} is not {should}");
    }

    #[test]
    fn gamma_q_has_its_closed_forms() {
        for x in [1e-6, 0.1, 1.0, 1.99, 2.01, 3.0, 10.0, 50.0] {
            close(gamma_q(1.0, x), libm::exp(-x));
            close(gamma_q(2.0, x), libm::exp(-x) * (1.0 + x));
            close(gamma_q(0.5, x), libm::erfc(x.sqrt()));
        }
    }

    #[test]
    fn chi2_p_values_match_tables() {
        // Critical values at 5% and 1% from the usual tables.
        for (statistic, degrees, p) in [
            (3.841_458_820_694_124, 1.0, 0.05),
            (18.307_038_053_275_146, 10.0, 0.05),
            (23.209_251_158_954_356, 10.0, 0.01),
            (124.342_113_404_004_07, 100.0, 0.05),
        ] {
            assert!((chi2_p_value(statistic, degrees) - p).abs() < 1e-10);
        }
        assert!((chi2_p_value(10_000.0, 10_000.0) - 0.498_119).abs() < 1e-5);
    }

    #[test]
    fn values_outside_the_domain_are_nan() {
        assert!(gamma_q(0.0, 1.0).is_nan() && gamma_q(1.0, -1.0).is_nan() && gamma_q(f64::NAN, 1.0).is_nan());
        assert!(chi2_p_value(f64::NAN, 3.0).is_nan());
    }

    #[test]
    fn sidak_levels_multiply_back() {
        let level = sidak(0.01, 60);
        close(libm::pow(1.0 - level, 60.0), 0.99);
        close(sidak(0.01, 1), 0.01);
    }
}
