//! Indices of the bones of a family.

/// Defines the indices of bones in the order in which they are added: those of the trunk, those of the left side,
/// each of which has a right one, and those added last. `COUNT` is the number of all; [`limb`] names those of a side.
macro_rules! bones {
    ($($trunk:ident)*; $($paired:ident)*; $($last:ident)*) => {
        #[allow(non_camel_case_types, clippy::upper_case_acronyms)]
        enum Trunk { $($trunk,)* END }
        #[allow(non_camel_case_types, clippy::upper_case_acronyms)]
        enum Paired { $($paired,)* END }
        #[allow(non_camel_case_types, clippy::upper_case_acronyms)]
        enum Last { $($last,)* END }

        /// Bones of one side.
        const PER_SIDE: usize = Paired::END as usize;
        pub(in crate::synth) const COUNT: usize = Trunk::END as usize + 2 * PER_SIDE + Last::END as usize;
        $(#[allow(dead_code)]
        pub(in crate::synth) const $trunk: usize = Trunk::$trunk as usize;)*
        $(#[allow(dead_code)]
        pub(in crate::synth) const $paired: usize = Trunk::END as usize + Paired::$paired as usize;)*
        $(#[allow(dead_code)]
        pub(in crate::synth) const $last: usize =
            Trunk::END as usize + 2 * PER_SIDE + Last::$last as usize;)*

        /// Bone `name` of the left (`side` 0) or right (1) side.
        pub(in crate::synth) fn limb(name: usize, side: usize) -> usize {
            name + side * PER_SIDE
        }

        /// Of a bone of either side the one of the left side; others as they are.
        #[allow(dead_code)]
        pub(in crate::synth) fn left(bone: usize) -> usize {
            let first = Trunk::END as usize;
            if (first..first + 2 * PER_SIDE).contains(&bone) { first + (bone - first) % PER_SIDE } else { bone }
        }
    };
}

pub(super) use bones;
