//! The species of insects.

use super::super::proportions::species;
use super::Proportions;

species! {
    ant {}
    beetle {
        size: 0.9, head: 0.95, head_width: 1.1, eye: 1.0, jaw: 1.3, neck: 0.3, thorax: 1.05, thorax_girth: 1.5, waist: 0.35,
        waist_girth: 2.6, abdomen: 1.2, abdomen_width: 1.5, abdomen_height: 1.05, feeler: 0.8, legs: 0.8,
        leg_girth: 1.25, knee_rise: 22.0, shell: 1.0,
    }
    spider {
        size: 1.1, head: 0.72, head_width: 1.1, eye: 1.2, jaw: 1.2, neck: 0.2, thorax: 0.9, thorax_girth: 1.1, waist: 0.5,
        waist_girth: 1.1, abdomen: 1.15, abdomen_width: 1.65, abdomen_height: 1.7, feeler: 0.5, legs: 1.75,
        leg_girth: 1.0, knee_rise: 52.0,
    }
    cricket {
        size: 1.0, head: 1.0, head_width: 1.0, eye: 1.2, jaw: 0.5, neck: 0.4, thorax: 1.1, thorax_girth: 1.25, waist: 0.4,
        waist_girth: 2.2, abdomen: 1.35, abdomen_width: 0.85, abdomen_height: 0.95, feeler: 1.9, legs: 0.82,
        leg_girth: 1.1, hind: 1.95, knee_rise: 48.0,
    }
    wasp {
        size: 0.9, head: 0.9, head_width: 1.15, eye: 1.7, jaw: 0.55, neck: 0.7, thorax: 1.0, thorax_girth: 1.3, waist: 1.1,
        waist_girth: 0.85, abdomen: 1.25, abdomen_width: 1.02, abdomen_height: 1.05, feeler: 0.85, legs: 0.9,
        leg_girth: 0.9, hind: 1.2, knee_rise: 30.0,
    }
    mantis {
        size: 1.2, head: 0.75, head_width: 1.35, eye: 1.5, jaw: 0.45, neck: 1.6, thorax: 1.7, thorax_girth: 0.78,
        waist: 0.5, waist_girth: 1.7, abdomen: 1.6, abdomen_width: 0.75, abdomen_height: 0.75, feeler: 0.9, legs: 1.35,
        leg_girth: 0.95, hind: 1.1, knee_rise: 40.0,
    }
}
