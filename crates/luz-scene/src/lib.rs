//! Scenes as plain data, and readers for them (pbrt-v4).
