//! One batch by many machines: the jobs that are written for render farms are run, with real processes at the same time, and what they leave is held
//! against what one machine leaves.

use crate::batch::{assert_same, batch, some, square};
use crate::cli::{Workdir, repository};
use serde_json::Value;
use std::io::Write;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

const PROGRAM: &str = env!("CARGO_BIN_EXE_glyphlight");

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// `batch plan` in that format; exit code, standard output, standard error.
fn plan(here: &Workdir, format: &str, args: &[&str]) -> (i32, String, String) {
    batch(here, &[&["plan", "--format", format, "--program", PROGRAM], args].concat())
}

/// Starts a line of shell in the folder.
fn shell(here: &Workdir, line: &str, path: Option<&Path>) -> Child {
    let mut command = Command::new("sh");
    command.args(["-c", line]).current_dir(here.path("")).stdin(Stdio::null()).stdout(Stdio::piped());
    if let Some(path) = path {
        let old = std::env::var_os("PATH").unwrap_or_default();
        let all = std::env::join_paths([path.into()].into_iter().chain(std::env::split_paths(&old))).unwrap();
        command.env("PATH", all);
    }
    command.stderr(Stdio::piped()).spawn().unwrap()
}

/// The commands of a step of a template, for each value of its parameter, with the job's parameters put in place.
fn commands(template: &Value, step: usize, parameters: &[(&str, &str)]) -> Vec<Vec<String>> {
    let step = &template["steps"][step];
    let run = &step["script"]["actions"]["onRun"];
    let words = std::iter::once(&run["command"]).chain(run["args"].as_array().unwrap());
    let words: Vec<&str> = words.map(|word| word.as_str().unwrap()).collect();
    let ranges = &step["parameterSpace"]["taskParameterDefinitions"][0];
    let ranges = ranges["range"].as_array().map_or(vec![""], |all| all.iter().map(|r| r.as_str().unwrap()).collect());
    let program = template["parameterDefinitions"][0]["default"].as_str().unwrap();
    let fill = |word: &str, items: &str| {
        let mut word = word.replace("{{Task.Param.Items}}", items).replace("{{Param.Glyphlight}}", program);
        for (name, value) in parameters {
            word = word.replace(&format!("{{{{Param.{name}}}}}"), value);
        }
        assert!(!word.contains("{{"), "{word}");
        word
    };
    ranges.into_iter().map(|items| words.iter().map(|word| fill(word, items)).collect()).collect()
}

/// Runs commands at the same time and gives what they say.
fn at_once(here: &Workdir, commands: &[Vec<String>]) -> Vec<Output> {
    let start = |words: &Vec<String>| {
        let mut command = Command::new(&words[0]);
        command.args(&words[1..]).current_dir(here.path("")).stdin(Stdio::null());
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    };
    let running: Vec<Child> = commands.iter().map(start).collect();
    running.into_iter().map(|child| child.wait_with_output().unwrap()).collect()
}

#[test]
fn tasks_at_once_make_the_whole_and_what_is_damaged_is_found() {
    let here = Workdir::new();
    some(&here, 9);
    assert_eq!(batch(&here, &["in", "-o", "whole", "--compare", "--exr"]).0, 1);
    let (code, out, err) = plan(&here, "openjd", &["in", "-o", "o", "--chunk", "3", "--compare", "--exr"]);
    assert_eq!(code, 0, "{err}");
    let template: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(template["specificationVersion"], "jobtemplate-2023-09");
    let names: Vec<&str> =
        template["parameterDefinitions"].as_array().unwrap().iter().map(|p| p["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["Glyphlight", "Input", "Out"]);
    assert_eq!(template["steps"][1]["dependencies"][0]["dependsOn"], template["steps"][0]["name"]);
    let parameters = [("Input", "in"), ("Out", "farm")];
    let parts = commands(&template, 0, &parameters);
    let items: Vec<&str> = parts.iter().map(|words| words[5].as_str()).collect();
    assert_eq!(items, ["1-3", "4-6", "7-9", "10-10"]);
    for done in at_once(&here, &parts) {
        // One item is broken; that is the whole's failure, not the part's.
        assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
        assert!(text(&done.stdout).contains("openjd_progress: 100.0"), "{}", text(&done.stdout));
    }
    // A picture that another host has damaged, and a part that is gone.
    let picture = here.path("farm/parts/4-6/pictures/04.png");
    let mut bytes = std::fs::read(&picture).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(&picture, bytes).unwrap();
    std::fs::rename(here.path("farm/parts/1-3"), here.path("elsewhere")).unwrap();
    let merge = commands(&template, 1, &parameters);
    let done = &at_once(&here, &merge)[0];
    let said = text(&done.stderr);
    assert_eq!(done.status.code(), Some(1));
    assert_eq!(said.matches("missing: ").count(), 4, "{said}");
    assert!(said.contains("04.svg: its picture in farm/parts/4-6 is not what was written there"), "{said}");
    assert!(said.contains("00.svg: no part has it"), "{said}");
    assert!(here.path("farm/parts").is_dir());
    // The farm repeats the task; the other part comes by another way.
    assert!(at_once(&here, &parts[1..2])[0].status.success());
    let from = ["in", "-o", "farm", "--merge", "farm/parts", "--merge", "elsewhere", "--compare", "--exr"];
    let (code, out, err) = batch(&here, &from);
    assert_eq!(code, 1, "{out}{err}");
    assert!(out.contains("0 missing") && out.contains("1 failed"), "{out}");
    assert_same(&here.path("whole"), &here.path("farm"));
    // Repeated, all is there already, failures as well.
    let done = &at_once(&here, &merge)[0];
    assert!(
        text(&done.stdout).contains("0 merged from 0 parts, 9 kept, 1 failed, 0 missing"),
        "{}",
        text(&done.stdout)
    );
    assert_same(&here.path("whole"), &here.path("farm"));
    // And a task that comes late does again what failed, no more.
    let late = &at_once(&here, &parts[2..])[0];
    assert!(text(&late.stdout).contains("0 done, 2 kept, 1 failed"), "{}", text(&late.stdout));
}

#[test]
fn folders_of_other_machines_are_merged_if_they_are_of_the_same_batch() {
    let here = Workdir::new();
    some(&here, 4);
    std::fs::remove_file(here.path("in/99 broken.svg")).unwrap();
    let run = |args: &[&str]| batch(&here, args);
    assert_eq!(run(&["in", "-o", "whole"]).0, 0);
    assert_eq!(run(&["in", "-o", "a", "--items", "1-2"]).0, 0);
    assert_eq!(run(&["in", "-o", "b", "--items", "3-"]).0, 0);
    assert_eq!(run(&["in", "-o", "other", "--items", "3-", "--radiance", "3"]).0, 0);
    let (code, _, err) = run(&["in", "-o", "merged", "--merge", "a", "--merge", "other"]);
    assert_eq!(code, 1);
    assert_eq!(err.matches("was made from another drawing, template or options").count(), 2, "{err}");
    let (code, out, err) = run(&["in", "-o", "merged", "--merge", "b"]);
    assert_eq!(code, 0, "{out}{err}");
    assert_same(&here.path("whole"), &here.path("merged"));
    // A drawing that has changed since.
    here.write("in/00.svg", square("#00ff00", 20));
    let (code, _, err) = run(&["in", "-o", "later", "--merge", "a", "--merge", "b"]);
    assert!(code == 1 && err.contains("00.svg: its part was made from another drawing"), "{err}");
    // Misuse.
    std::fs::create_dir(here.path("empty")).unwrap();
    for (folder, reason) in [("empty", "there is no manifest.jsonl"), ("nowhere", "there is no manifest.jsonl")] {
        let (code, _, err) = run(&["in", "-o", "m", "--merge", folder]);
        assert!(code == 2 && err.contains(reason), "{err}");
    }
    let lock = std::fs::File::open(here.path("b/.lock")).unwrap();
    lock.lock().unwrap();
    let (code, _, err) = run(&["in", "-o", "m", "--merge", "b"]);
    assert!(code == 2 && err.contains("b: another batch is writing to this folder"), "{err}");
    drop(lock);
    assert_ne!(run(&["in", "-o", "m", "--merge", "b", "--part", "--items", "1"]).0, 0);
    assert_ne!(run(&["in", "-o", "m", "--part"]).0, 0);
}

/// An `sbatch` that runs an array's tasks all at the same time, and a dependent job after them.
const SBATCH: &str = r#"#!/bin/sh
last=
for word in "$@"; do
    case $word in
        --array=1-*) last=${word#--array=1-} ;;
        --dependency=afterany:77) ;;
        --dependency=*) exit 9 ;;
    esac
done
cat > "job$last.sh"
printf '%s\n' "$*" >> submitted
if [ -z "$last" ]; then sh job.sh > merge.out 2>&1; echo $? > merge.code; echo 78; exit 0; fi
for task in $(seq $last); do SLURM_ARRAY_TASK_ID=$task sh "job$last.sh" > "task$task.out" 2>&1 & done
wait
echo '77;cluster'
"#;

#[test]
fn a_slurm_script_submits_an_array_and_what_follows_it() {
    let here = Workdir::new();
    let folder = "it's a \"$HOME\" `x` & * [folder]";
    std::fs::create_dir(here.path(folder)).unwrap();
    for i in 0..5 {
        here.write(&format!("{folder}/{i} 'q'.svg"), square("#ff8000", 5 + 6 * i));
    }
    std::fs::create_dir(here.path("bin")).unwrap();
    here.write("bin/sbatch", SBATCH);
    Command::new("chmod").arg("+x").arg(here.path("bin/sbatch")).status().unwrap();
    assert_eq!(batch(&here, &[folder, "-o", "whole", "--exposure", "-1"]).0, 0);
    let (code, script, err) = plan(&here, "slurm", &[folder, "-o", "sh'ared 100%", "--chunk", "2", "--exposure", "-1"]);
    assert_eq!(code, 0, "{err}");
    here.write("submit.sh", &script);
    let submit = || shell(&here, "sh submit.sh --partition=night", Some(&here.path("bin"))).wait_with_output().unwrap();
    let done = submit();
    assert!(done.status.success(), "{}", text(&done.stderr));
    let submitted = std::fs::read_to_string(here.path("submitted")).unwrap();
    assert_eq!(submitted.matches("--partition=night").count(), 2, "{submitted}");
    assert!(submitted.contains("--array=1-3 --output=sh'ared 100%%-%A_%a.log"), "{submitted}");
    let said = std::fs::read_to_string(here.path("merge.out")).unwrap();
    assert!(said.contains("5 merged from 3 parts, 0 kept, 0 failed, 0 missing"), "{said}");
    assert_same(&here.path("whole"), &here.path("sh'ared 100%"));
    // With other options they are other pictures.
    here.write("submit.sh", script.replace("--exposure=-1", "--exposure=1"));
    assert!(submit().status.success());
    let same = |name: &str| std::fs::read(here.path(name).join("pictures/0 _q_.png")).unwrap();
    assert_ne!(same("whole"), same("sh'ared 100%"));
}

#[test]
fn a_list_of_commands_is_one_line_each() {
    let here = Workdir::new();
    here.write("a b.svg", square("#ffffff", 10));
    here.write("c.svg", square("#ffffff", 30));
    here.write("it's.svg", square("#ffffff", 20));
    let inputs = ["a b.svg", "c.svg", "it's.svg"];
    assert_eq!(batch(&here, &[&inputs[..], &["-o", "whole"]].concat()).0, 0);
    let (code, lines, err) = plan(&here, "cuecmd", &[&inputs[..], &["-o", "o", "--chunk", "1"]].concat());
    assert_eq!((code, lines.lines().count()), (0, 3), "{lines}{err}");
    let running: Vec<Child> = lines.lines().map(|line| shell(&here, line, None)).collect();
    for child in running {
        assert!(child.wait_with_output().unwrap().status.success());
    }
    let last = err.lines().find_map(|line| line.strip_prefix("when all frames are done: ")).unwrap();
    assert!(shell(&here, last, None).wait_with_output().unwrap().status.success());
    assert_same(&here.path("whole"), &here.path("o"));
}

#[test]
fn what_cannot_be_a_job_is_refused_at_once() {
    let here = Workdir::new();
    here.write("a.svg", square("#ffffff", 10));
    here.write("a\nb.svg", square("#ffffff", 10));
    here.write("own.toml", "x = 1");
    let many = format!("file\n{}", "a.svg\n".repeat(1001));
    here.write("many.csv", many);
    let refused = |format: &str, args: &[&str], reason: &str| {
        let (code, out, err) = plan(&here, format, &[args, &["-o", "o"]].concat());
        assert!(code == 2 && out.is_empty() && err.contains(reason), "{args:?}: {code}\n{out}\n{err}");
    };
    for format in ["openjd", "slurm", "cuecmd"] {
        refused(format, &["a\nb.svg"], r#""a\nb.svg" holds a control character"#);
        refused(format, &["a.svg", "--items", "1"], "--items: a plan is of the whole batch");
        refused(format, &["a.svg", "--json"], "--json: a plan is of the whole batch");
        refused(format, &["nothing"], "nothing: there is no such file or folder");
        refused(format, &["a.svg", "--scene", "own.toml"], "own.toml");
    }
    refused(
        "slurm",
        &["many.csv", "--chunk", "1"],
        "1001 items make 1001 tasks; a Slurm array takes 1000: from --chunk 2",
    );
    let (code, out, _) = plan(&here, "slurm", &["many.csv", "-o", "o"]);
    assert!(code == 0 && out.contains("--array=1-63 "), "{out}");
    let (code, out, _) = plan(&here, "openjd", &["many.csv", "-o", "o", "--chunk", "1"]);
    assert_eq!(code, 0);
    assert!(serde_json::from_str::<Value>(&out).unwrap()["steps"][0].to_string().contains("1001-1001"));
    assert_eq!(here.files().iter().filter(|path| path.ends_with("o")).count(), 0, "a plan writes nothing");
}

/// `openjd` of openjd-cli, or `None` with a loud line. With `CI` or `GLYPHLIGHT_REQUIRE_OPENJD` set that is a failure.
fn openjd(args: &[&str], here: &Workdir) -> Option<Output> {
    let output = Command::new("openjd").args(args).current_dir(here.path("")).stdin(Stdio::null()).output();
    match output {
        Ok(output) => Some(output),
        Err(error) => {
            let required = ["CI", "GLYPHLIGHT_REQUIRE_OPENJD"].iter().any(|name| std::env::var_os(name).is_some());
            assert!(!required, "openjd (pip install openjd-cli; sh tests/run does) is required here: {error}");
            let line = format!("SKIPPED: jobs of Open Job Description were NOT run: openjd: {error}\n");
            std::io::stderr().write_all(line.as_bytes()).unwrap();
            None
        }
    }
}

#[test]
fn open_job_description_runs_what_is_written() {
    let here = Workdir::new();
    let input = here.path("in put");
    std::fs::create_dir(&input).unwrap();
    for i in 0..7 {
        here.write(&format!("in put/{i}.svg"), square(&format!("#ff{:02x}00", 30 * i), 5 + 5 * i));
    }
    for name in ["star", "knot", "ring"] {
        let svg = std::fs::read(repository("svg").join(format!("{name}.svg"))).unwrap();
        here.write(&format!("in put/{name}.svg"), svg);
    }
    here.write("own.toml", std::fs::read_to_string(repository("src/scene/templates/floor.toml")).unwrap());
    let args = ["--scene", "own.toml", "--chunk", "4", "--compare"];
    let (code, template, err) = plan(&here, "openjd", &[&["in put", "-o", "o"], &args[..]].concat());
    assert_eq!(code, 0, "{err}");
    here.write("job.json", &template);
    let Some(checked) = openjd(&["check", "job.json"], &here) else { return };
    assert!(checked.status.success(), "{}", text(&checked.stdout));
    here.write("bad.json", template.replace("jobtemplate-2023-09", "jobtemplate-2023-10"));
    assert!(!openjd(&["check", "bad.json"], &here).unwrap().status.success());

    let run = ["run", "job.json", "-p", "Input=in put", "-p", "Out=farm", "-p", "Scene=own.toml"];
    let ran = openjd(&run, &here).unwrap();
    let said = text(&ran.stdout);
    assert!(ran.status.success(), "{said}\n{}", text(&ran.stderr));
    for line in ["openjd_progress: 25.0", "openjd_progress: 100.0", "openjd_status: 4 of 4, 0 failed"] {
        assert!(said.contains(line), "{said}");
    }
    assert!(!said.contains("ERROR"), "{said}");
    let scene = here.path("own.toml");
    let (input, scene) = (input.to_str().unwrap(), scene.to_str().unwrap());
    assert_eq!(batch(&here, &[input, "-o", "whole", "--scene", scene, "--compare"]).0, 0);
    assert_same(&here.path("whole"), &here.path("farm"));
}
