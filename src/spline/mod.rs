//! Natural cubic splines (Warren & Weimer, *Subdivision Methods for Geometric Design*, chapter 6).
