//! Pictures and attributes: colours of a map, the coloured pair, its picture, transfer, the HTML viewer.

mod blend;
mod colormap;
mod error;
mod facing;
mod fit;
mod pair;
mod picture;
mod transfer;
mod uv;
mod viewer;

pub use colormap::{UNMATCHED_COLOR, map_colors, position_colors};
pub use error::RenderError;
pub use fit::fit_skeleton;
pub use pair::side_by_side;
pub use picture::{Picture, pair_picture, picture, textured_picture};
pub use transfer::{Donors, transfer_attributes, transfer_landmarks, transfer_values};
pub use viewer::{ViewerPair, viewer_html};
