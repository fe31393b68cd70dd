//! Pictures and attributes: colours of a map, transfer, the HTML viewer.
