//! Owen-scrambled Sobol' points, four dimensions at a time.
