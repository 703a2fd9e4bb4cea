//! Where a live run is found.
