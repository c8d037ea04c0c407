//! Contact sheets and tables: records in, files out.
