//! SVG pictures of curves.
