//! Pictures against the replay, against XML, and against their bounds.
