//! The commands and their own options.

use super::help_text;
use super::options::{
    AccuracyOption, CacheOption, MeshingOptions, TracingOptions, parse_count, parse_limit, parse_listed,
    parse_parts, parse_seconds, parse_share, parse_threads,
};
use crate::step;
use clap::{Parser, Subcommand, ValueEnum};
use std::path::PathBuf;

/// Share of energy that may be lost without a word: what rounding and grazing rays lose in a sound scene is far below it.
const MOST_LOST: f64 = 1e-6;

/// Heading of the options that every command has.
const EVERYWHERE: &str = "Everywhere";

/// CAD surfaces straight to optical simulation: a STEP file goes in, quad facets within a proved tolerance, a traced
/// light distribution and an account of what its accuracy cost come out.
#[derive(Debug, Parser)]
#[command(name = "lampyris", version, max_term_width = 100, propagate_version = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Print one JSON document on stdout instead of text
    #[arg(long, global = true, display_order = 901, help_heading = EVERYWHERE)]
    pub(crate) json: bool,
    /// Print nothing but results and the reason for a non-zero exit code
    #[arg(short, long, global = true, display_order = 902, help_heading = EVERYWHERE)]
    pub(crate) quiet: bool,
    /// Say more
    #[arg(short, long, global = true, action = clap::ArgAction::Count, display_order = 903, help_heading = EVERYWHERE)]
    pub(crate) verbose: u8,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Run the main job on the built-in three-cavity lamp and write a report
    Demo {
        /// Folder for the report and all results
        #[arg(short, long, default_value = "lampyris-demo", value_name = "DIR")]
        output: PathBuf,
        #[command(flatten)]
        report: ReportOption,
        #[command(flatten)]
        meshing: MeshingOptions,
        #[command(flatten)]
        tracing: TracingOptions,
    },
    /// Say what a STEP file holds and what could not be read
    Info {
        /// STEP file
        file: PathBuf,
        /// List parts, solids and faces, each face with its #id, kind, area and a point on it
        #[arg(long)]
        faces: bool,
        #[command(flatten)]
        limits: RefusalLimit,
        #[command(flatten)]
        placed: PlacedLimit,
    },
    /// Tessellate a STEP file into quad facets
    #[command(after_help = help_text::FACET, after_long_help = help_text::FACET_LONG)]
    Facet(FacetCommand),
    /// Simulate a scene and write a report, results.json and the receiver files
    #[command(after_help = help_text::TRACE, mut_args(help_text::explain_trace_option))]
    Trace {
        /// Scene file
        scene: PathBuf,
        /// Folder for the report and all results (for a shard: the .tally file)
        #[arg(short, long, default_value = "lampyris-results", value_name = "DIR")]
        output: PathBuf,
        #[command(flatten)]
        meshing: MeshingOptions,
        #[command(flatten)]
        tracing: TracingOptions,
        #[command(flatten)]
        extra: Box<TraceOptions>,
    },
    /// Compare octree, BVH and exact spline ray by ray
    #[command(after_help = help_text::CHECK, after_long_help = help_text::CHECK_LONG)]
    Check(Box<CheckCommand>),
    /// Measure what accuracy costs in time
    #[command(after_help = help_text::STUDY, mut_args(help_text::explain_study_option))]
    Study {
        /// Which question
        kind: StudyKind,
        /// STEP file or scene, the built-in lamp by default; `effects` takes a scene alone, `complexity` and `stability` take none
        file: Option<PathBuf>,
        /// Folder for report, rows and pictures
        #[arg(short, long, value_name = "DIR")]
        output: Option<PathBuf>,
        /// `bvh`: ask the rays of a file (CSV, NPZ, TM-25, Zemax, LightTools, or records as `check --rays-out` writes them)
        #[arg(long, value_name = "FILE")]
        rays_in: Option<PathBuf>,
        /// `bvh`: compare with Embree 4 too, a library such as libembree4.so.4 of your own
        #[arg(long, value_name = "LIBRARY")]
        embree: Option<PathBuf>,
        #[command(flatten)]
        report: ReportOption,
        #[command(flatten)]
        meshing: MeshingOptions,
        #[command(flatten)]
        tracing: TracingOptions,
    },
    /// Merge the results of shards into one
    Merge {
        /// The .tally files of all shards, or the folder that they are in
        #[arg(required = true, value_name = "PART|DIR")]
        parts: Vec<PathBuf>,
        /// Folder for the merged results
        #[arg(short, long, value_name = "DIR")]
        output: PathBuf,
        /// The scene, where it is no longer at the place that the parts name
        #[arg(long, value_name = "FILE")]
        scene: Option<PathBuf>,
        /// Seconds to wait for parts that are still missing, or still being copied
        #[arg(long, value_name = "SECONDS", value_parser = parse_seconds, allow_negative_numbers = true)]
        wait: Option<f64>,
        /// Rays of the whole run, where further ranges of a run that grows are still to come
        #[arg(long, value_name = "N", value_parser = parse_count, allow_negative_numbers = true)]
        rays: Option<u64>,
        /// Say how many rays are still missing until the statistical error (1σ) of a receiver's power, or of its :cells, is below P
        /// percent; the exit code is 4 as long as there are any
        #[arg(long, value_name = "P%@RECEIVER")]
        until_error: Option<String>,
        /// Largest share of energy that may be lost before the exit code becomes 4
        #[arg(long, value_name = "SHARE", default_value_t = MOST_LOST, value_parser = parse_share, allow_negative_numbers = true)]
        max_lost: f64,
        #[command(flatten)]
        cache: CacheOption,
        #[command(flatten)]
        report: ReportOption,
        #[command(flatten)]
        limits: RefusalLimit,
    },
    /// List or remove the models, facets and octrees that are kept from earlier runs; --cache or LAMPYRIS_CACHE must name the folder
    Cache {
        #[command(flatten)]
        folder: CacheOption,
        /// Remove all of it
        #[arg(long)]
        clear: bool,
    },
    /// Judge a far field by a lamp regulation: pass, fail or unsure, row by row
    Assess {
        /// Results of a run: its folder or results.json
        result: Option<PathBuf>,
        /// The regulation and function, such as "UN R149-01 C passing"; by default the one that the results were judged by
        #[arg(long, value_name = "ID")]
        regulation: Option<String>,
        /// Name of the far field, where the run has several
        #[arg(long, value_name = "NAME")]
        receiver: Option<String>,
        /// Left-hand traffic: the tables mirrored
        #[arg(long)]
        left_hand: bool,
        /// Measure the lamp as it was placed, without the regulation's aiming
        #[arg(long)]
        as_placed: bool,
        /// List the regulations there are tables of
        #[arg(long)]
        list: bool,
    },
    /// Write a commented scene for a STEP file
    Init {
        /// STEP file
        file: PathBuf,
        /// Scene file to write; by default named after the STEP file, in the working folder
        #[arg(short, long, value_name = "SCENE.toml")]
        output: Option<PathBuf>,
        #[command(flatten)]
        limits: RefusalLimit,
        #[command(flatten)]
        placed: PlacedLimit,
    },
    /// List the media that a scene may name
    Media,
    /// Print the licences of what the binary holds
    Licences,
    /// Print the JSON Schema of the scene file, or every key of it in words
    Schema {
        /// A page for people, in Markdown
        #[arg(long)]
        text: bool,
    },
    /// Print a completion script
    Completions {
        /// Shell to complete in
        shell: clap_complete::Shell,
    },
    /// Print the manual page, or write one page a command into a folder
    Man {
        /// Folder for the pages
        #[arg(short, long, value_name = "DIR")]
        output: Option<PathBuf>,
    },
}

/// What `facet` takes. Roles are those of a scene, which it has not.
#[derive(Debug, clap::Args)]
#[command(mut_arg("role", |role| role.hide(true)))]
pub(crate) struct FacetCommand {
    /// STEP file
    pub(crate) file: PathBuf,
    /// File to write, by extension: .obj .ply .stl .vtu .glb .data2; may be given several times
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) meshing: MeshingOptions,
    #[command(flatten)]
    pub(crate) precision: AccuracyOption,
    /// Mesh the model by truck-meshalgo too, at the tight end of the tolerance, and set it beside ours
    #[arg(long)]
    pub(crate) baseline: bool,
    /// Number of threads; as many as there are cores by default, and never more than 16 for each core, however many are asked for
    #[arg(long, value_name = "N", value_parser = parse_threads, allow_negative_numbers = true)]
    pub(crate) threads: Option<usize>,
    #[command(flatten)]
    pub(crate) limits: RefusalLimit,
    #[command(flatten)]
    pub(crate) placed: PlacedLimit,
}

/// What `check` takes.
#[derive(Debug, clap::Args)]
pub(crate) struct CheckCommand {
    /// STEP file or scene
    pub(crate) file: PathBuf,
    #[command(flatten)]
    pub(crate) meshing: MeshingOptions,
    #[command(flatten)]
    pub(crate) tracing: TracingOptions,
    #[command(flatten)]
    pub(crate) precision: AccuracyOption,
    /// Folder for a report with the disagreeing rays in 3-D, and for check.json
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) report: ReportOption,
    /// Write the rays used and the octree's answers
    #[arg(long, value_name = "FILE")]
    pub(crate) rays_out: Option<PathBuf>,
    /// Use the rays of a file
    #[arg(long, value_name = "FILE", visible_alias = "replay")]
    pub(crate) rays_in: Option<PathBuf>,
    /// Write the rays that were answered differently, to be asked again with --replay
    #[arg(long, value_name = "FILE")]
    pub(crate) disagreements: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) limits: RefusalLimit,
    #[command(flatten)]
    pub(crate) placed: PlacedLimit,
}

/// Options of `trace` alone.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct TraceOptions {
    #[command(flatten)]
    pub(crate) precision: AccuracyOption,
    /// Trace only part I of N (I from 1) into a .tally file, for `lampyris merge`; `auto` takes both from the launcher (Slurm,
    /// Open MPI, PMI, PBS, Kubernetes)
    #[arg(long, value_name = "I/N|auto", conflicts_with_all = ["paths", "verify_pruning", "until_error"])]
    pub(crate) shard: Option<String>,
    /// Number of parts for `--shard auto` where the launcher does not say it
    #[arg(long, value_name = "N", requires = "shard", value_parser = parse_parts, allow_negative_numbers = true)]
    pub(crate) shards: Option<u32>,
    /// Go on where an interrupted run stopped, with the same scene and options, the number of rays among them
    #[arg(long)]
    pub(crate) resume: bool,
    /// Save a long run every so many seconds, for --resume
    #[arg(long, value_name = "SECONDS", default_value_t = 30.0, value_parser = parse_seconds, allow_negative_numbers = true)]
    pub(crate) checkpoint: f64,
    /// Trace until the statistical error (1σ) of a receiver's power is below P percent, or, with :cells after its name, that of
    /// its cells weighted by their light; --rays is then the most to trace
    #[arg(long, value_name = "P%@RECEIVER", conflicts_with_all = ["shard", "verify_pruning", "paths"])]
    pub(crate) until_error: Option<String>,
    /// Trace until no row of the scene's [[regulation]] is unsure by the rays, or say that it cannot; --rays is then the most to trace
    #[arg(long, conflicts_with_all = ["shard", "verify_pruning", "paths", "until_error"])]
    pub(crate) until_settled: bool,
    /// Write every vertex of every ray path, in constant memory: arrays ray, branch, bounce, event, point (mm) and power (share
    /// of an average ray), in no particular order; events from 0: emitted, split, reflected, transmitted, scattered, absorbed,
    /// received, escaped, cut off, lost
    #[arg(long, value_name = "FILE.npz", conflicts_with_all = ["resume", "verify_pruning"])]
    pub(crate) paths: Option<PathBuf>,
    /// Trace every ray of the scene's ray lists once more, whatever share of the power it has, and write where each ended: source, ray
    /// (its place in the list), branch, event (numbered as for --paths), face (-1 for none), bounces, point (mm; of light that left
    /// one on its way), direction and power (what came there, in the unit of the run)
    #[arg(long, value_name = "FILE.npz|csv", conflicts_with_all = ["shard", "replay"])]
    pub(crate) ends: Option<PathBuf>,
    /// Group the light of each receiver by the faces it met and what happened there, and list the N ways of most power, each with its
    /// error; each ray is then traced twice, and no other figure changes
    #[arg(long, value_name = "N", conflicts_with = "verify_pruning", value_parser = parse_listed, allow_negative_numbers = true)]
    pub(crate) sequences: Option<u32>,
    /// List the N faces that absorb and let out most, with the power that enters and leaves their bodies through them and its error
    #[arg(long, value_name = "N", value_parser = parse_listed, allow_negative_numbers = true)]
    pub(crate) faces: Option<u32>,
    /// Trace one ray again and show its path; a lost_rays.csv for all the rays in it; may be given several times
    #[arg(long, value_name = "RAY|FILE", conflicts_with_all = ["shard", "resume", "until_error", "until_settled", "verify_pruning", "paths", "dry_run"])]
    pub(crate) replay: Vec<String>,
    /// Run the full kernel too and compare every tally bit by bit
    #[arg(long, conflicts_with_all = ["shard", "resume"])]
    pub(crate) verify_pruning: bool,
    /// Read, check and tessellate, say what would be done, trace nothing
    #[arg(long)]
    pub(crate) dry_run: bool,
    /// Largest share of energy that may be lost before the exit code becomes 4
    #[arg(long, value_name = "SHARE", default_value_t = MOST_LOST, value_parser = parse_share, allow_negative_numbers = true)]
    pub(crate) max_lost: f64,
    #[command(flatten)]
    pub(crate) cache: CacheOption,
    #[command(flatten)]
    pub(crate) report: ReportOption,
    #[command(flatten)]
    pub(crate) limits: RefusalLimit,
}

/// Whether a report is written.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub(crate) struct ReportOption {
    /// Write no report.html with its figures and tables
    #[arg(long, overrides_with = "report")]
    no_report: bool,
    /// Write report.html, figures and tables (the default)
    #[arg(long, overrides_with = "no_report")]
    report: bool,
}

impl ReportOption {
    /// Whether report.html, figures and tables are to be written.
    pub(crate) fn is_wanted(self) -> bool {
        !self.no_report
    }
}

/// How much the assemblies of a STEP file may place.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(crate) struct PlacedLimit {
    /// Most products and shapes that the assemblies of a STEP file may place; beyond it the file is refused
    #[arg(
        long, value_name = "COUNT", default_value_t = step::Settings::default().max_placed, value_parser = parse_limit, allow_negative_numbers = true
    )]
    max_placed: u64,
}

impl PlacedLimit {
    /// Returns the settings with which a file is read within it, all others as by default.
    pub(crate) fn settings(self) -> step::Settings {
        step::Settings { max_placed: self.max_placed, ..step::Settings::default() }
    }
}

impl Default for PlacedLimit {
    fn default() -> Self {
        Self { max_placed: step::Settings::default().max_placed }
    }
}

/// What of a model may be missing.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(crate) struct RefusalLimit {
    /// Largest share of faces that may be refused before the exit code becomes 4
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = parse_share, allow_negative_numbers = true)]
    pub(crate) max_refused: f64,
}

/// The studies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum StudyKind {
    /// Tolerance × normals × intersector: the cost–accuracy front
    Accuracy,
    /// Nearest, bilinear, cubic and exact normals (the seed paper's table 2)
    Interpolation,
    /// Three lamps before and after (the seed paper's table 1)
    Complexity,
    /// Rays through edges, vertices, tangents and other trouble
    Stability,
    /// Octree against bounding-volume hierarchies of four authors
    Bvh,
    /// What each optical effect costs
    Effects,
}

impl StudyKind {
    /// Returns the name of the study as it is typed.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Accuracy => "accuracy",
            Self::Interpolation => "interpolation",
            Self::Complexity => "complexity",
            Self::Stability => "stability",
            Self::Bvh => "bvh",
            Self::Effects => "effects",
        }
    }
}
