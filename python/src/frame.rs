//! Rows in and out through Arrow's C interface: nothing is copied on the way in.

use std::sync::Arc;

use arrow_array::builder::{Float64Builder, Int64Builder, StringBuilder};
use arrow_array::cast::AsArray;
use arrow_array::ffi_stream::{ArrowArrayStreamReader, FFI_ArrowArrayStream};
use arrow_array::types::{
    Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, TimestampMicrosecondType,
    TimestampMillisecondType, TimestampNanosecondType, TimestampSecondType, UInt8Type, UInt16Type, UInt32Type,
    UInt64Type,
};
use arrow_array::{Array, ArrayRef, RecordBatch, RecordBatchIterator};
use arrow_schema::{DataType, Field, Schema, SchemaRef, TimeUnit};
use leak_table::Fault;
use prognoser::fields::{self, COLUMNS, StrokeField, TIME_COLUMN};
use prognoser::{ConditionColumn, FaultCall, LogErrorKind, Prognosis, Reading};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyCapsule;

use crate::error::refused;

/// The name that Arrow gives the capsule of a stream.
const STREAM: &std::ffi::CStr = c"arrow_array_stream";

/// The batches of a data frame.
#[expect(
    unsafe_code,
    reason = "the stream of another library is taken over by its address, as Arrow's interface wants"
)]
pub fn read(frame: &Bound<'_, PyAny>) -> PyResult<Vec<RecordBatch>> {
    if !frame.hasattr("__arrow_c_stream__")? {
        return Err(PyTypeError::new_err(format!(
            "found {}, expected a data frame with Arrow's C interface: pandas (2.2 or later, with pyarrow), Polars, a \
             pyarrow table or batch",
            frame.get_type().name()?
        )));
    }
    let capsule = frame.call_method0("__arrow_c_stream__")?;
    let capsule = capsule.cast::<PyCapsule>()?;
    let stream = capsule.pointer_checked(Some(STREAM))?.cast::<FFI_ArrowArrayStream>();
    // SAFETY: a capsule of this name holds a valid stream, which is moved out of it here and released by the reader.
    let reader = unsafe { ArrowArrayStreamReader::from_raw(stream.as_ptr()) }.map_err(refused)?;
    reader.collect::<Result<Vec<_>, _>>().map_err(refused)
}

/// A column of texts.
enum Texts<'a> {
    Small(&'a arrow_array::StringArray),
    Large(&'a arrow_array::LargeStringArray),
    View(&'a arrow_array::StringViewArray),
    /// Place of each row's text among the distinct ones.
    Coded(&'a dyn Array, Vec<usize>, Box<Texts<'a>>),
}

impl<'a> Texts<'a> {
    fn of(array: &'a dyn Array) -> Option<Self> {
        Some(match array.data_type() {
            DataType::Utf8 => Self::Small(array.as_string()),
            DataType::LargeUtf8 => Self::Large(array.as_string()),
            DataType::Utf8View => Self::View(array.as_string_view()),
            DataType::Dictionary(..) => {
                let coded = array.as_any_dictionary();
                if coded.values().is_empty() {
                    return None;
                }
                Self::Coded(array, coded.normalized_keys(), Box::new(Self::of(coded.values().as_ref())?))
            }
            _ => return None,
        })
    }

    fn at(&self, row: usize) -> Option<&str> {
        match self {
            Self::Small(all) => all.is_valid(row).then(|| all.value(row)),
            Self::Large(all) => all.is_valid(row).then(|| all.value(row)),
            Self::View(all) => all.is_valid(row).then(|| all.value(row)),
            Self::Coded(all, places, texts) => {
                if all.is_valid(row) {
                    texts.at(places[row])
                } else {
                    None
                }
            }
        }
    }
}

/// A column of a log.
enum Column<'a> {
    Texts(Texts<'a>),
    /// Not a number where nothing is known.
    Numbers(Box<dyn Fn(usize) -> f64 + Send + Sync + 'a>),
    /// Of all rows nothing is known.
    Nothing,
}

macro_rules! numbers {
    ($array:expr, $type:ty, $as:expr) => {{
        let all = $array.as_primitive::<$type>();
        Column::Numbers(Box::new(move |row| if all.is_valid(row) { $as(all.value(row)) } else { f64::NAN }))
    }};
}

impl<'a> Column<'a> {
    fn of(name: &str, array: &'a ArrayRef) -> PyResult<Self> {
        if let Some(texts) = Texts::of(array.as_ref()) {
            return Ok(Self::Texts(texts));
        }
        Ok(match array.data_type() {
            DataType::Null => Self::Nothing,
            DataType::Dictionary(..) if array.null_count() == array.len() => Self::Nothing,
            DataType::Float64 => numbers!(array, Float64Type, |value| value),
            DataType::Float32 => numbers!(array, Float32Type, f64::from),
            // Cycles are checked to be below 2^53.
            DataType::Int64 => numbers!(array, Int64Type, |value| value as f64),
            DataType::UInt64 => numbers!(array, UInt64Type, |value| value as f64),
            DataType::Int32 => numbers!(array, Int32Type, f64::from),
            DataType::UInt32 => numbers!(array, UInt32Type, f64::from),
            DataType::Int16 => numbers!(array, Int16Type, f64::from),
            DataType::UInt16 => numbers!(array, UInt16Type, f64::from),
            DataType::Int8 => numbers!(array, Int8Type, f64::from),
            DataType::UInt8 => numbers!(array, UInt8Type, f64::from),
            other => {
                return Err(refused(format!(
                    "column {name:?}: found values of type {other}, expected numbers or text"
                )));
            }
        })
    }

    fn stroke(&self, row: usize, name: &'static str, empty_is_stalled: bool) -> Result<StrokeField, LogErrorKind> {
        match self {
            Self::Texts(texts) => {
                fields::stroke_of_text(name, texts.at(row).unwrap_or_default().trim_ascii(), empty_is_stalled)
            }
            Self::Numbers(at) => fields::stroke_of_number(name, at(row), empty_is_stalled),
            Self::Nothing => Ok(StrokeField { time_s: None, stalled: empty_is_stalled }),
        }
    }
}

/// When rows were.
enum Times<'a> {
    Texts(Texts<'a>),
    /// Formatted as RFC 3339.
    Instants(Vec<Option<String>>),
}

impl<'a> Times<'a> {
    fn of(array: &'a ArrayRef) -> PyResult<Self> {
        if let Some(texts) = Texts::of(array.as_ref()) {
            return Ok(Self::Texts(texts));
        }
        macro_rules! instants {
            ($type:ty, $zone:expr) => {{
                let all = array.as_primitive::<$type>();
                // With a zone the numbers count in UTC.
                let zone = if $zone.is_some() { "Z" } else { "" };
                let at = |row: usize| all.is_valid(row).then(|| all.value_as_datetime(row)).flatten();
                let written =
                    (0..all.len()).map(|row| at(row).map(|at| format!("{}{zone}", at.format("%Y-%m-%dT%H:%M:%S%.f"))));
                Self::Instants(written.collect())
            }};
        }
        Ok(match array.data_type() {
            DataType::Timestamp(TimeUnit::Second, zone) => instants!(TimestampSecondType, zone),
            DataType::Timestamp(TimeUnit::Millisecond, zone) => instants!(TimestampMillisecondType, zone),
            DataType::Timestamp(TimeUnit::Microsecond, zone) => instants!(TimestampMicrosecondType, zone),
            DataType::Timestamp(TimeUnit::Nanosecond, zone) => instants!(TimestampNanosecondType, zone),
            DataType::Null => Self::Instants(vec![None; array.len()]),
            other => {
                return Err(refused(format!(
                    "column {TIME_COLUMN:?}: found values of type {other}, expected text or timestamps"
                )));
            }
        })
    }

    fn at(&self, row: usize) -> Option<&str> {
        match self {
            Self::Texts(texts) => texts.at(row).map(str::trim_ascii),
            Self::Instants(all) => all[row].as_deref(),
        }
    }
}

/// The columns of a log in a batch.
pub struct Columns<'a> {
    valve: Texts<'a>,
    cycle: Column<'a>,
    close: Column<'a>,
    open: Column<'a>,
    time: Option<Times<'a>>,
    conditions: Vec<(ConditionColumn, Column<'a>)>,
    empty_is_stalled: bool,
    /// Number of rows.
    pub rows: usize,
}

impl<'a> Columns<'a> {
    /// Finds them by the names of a log's columns; others are not used.
    pub fn of(batch: &'a RecordBatch, empty_is_stalled: bool) -> PyResult<Self> {
        let schema = batch.schema_ref();
        let column = |name: &str| {
            let mut places = schema.fields().iter().enumerate().filter(|(_, field)| field.name() == name);
            match (places.next(), places.next()) {
                (_, Some(_)) => Err(refused(format!("found column {name:?} twice, expected it once"))),
                (place, None) => Ok(place.map(|(place, _)| batch.column(place))),
            }
        };
        let wanted = |name: &str| {
            column(name)?.ok_or_else(|| {
                let found: Vec<&str> = schema.fields().iter().map(|field| field.name().as_str()).collect();
                refused(format!("found columns {}, expected also {name:?}", found.join(", ")))
            })
        };
        let [valve, cycle, close, open] = COLUMNS;
        let of = |name: &str| Column::of(name, wanted(name)?);
        let mut conditions: Vec<(ConditionColumn, Column<'a>)> = Vec::new();
        for (field, array) in schema.fields().iter().zip(batch.columns()) {
            let Some(column) = ConditionColumn::named(field.name()) else { continue };
            if conditions.iter().any(|(other, _)| other.is_pressure() == column.is_pressure()) {
                return Err(refused(format!("found two columns {}, expected one", column.quantity())));
            }
            conditions.push((column, Column::of(field.name(), array)?));
        }
        let names = wanted(valve)?;
        Ok(Self {
            valve: Texts::of(names.as_ref()).ok_or_else(|| {
                refused(format!("column {valve:?}: found values of type {}, expected text", names.data_type()))
            })?,
            cycle: of(cycle)?,
            close: of(close)?,
            open: of(open)?,
            time: column(TIME_COLUMN)?.map(Times::of).transpose()?,
            conditions,
            empty_is_stalled,
            rows: batch.num_rows(),
        })
    }

    /// The valve of a row; empty where there is no name.
    pub fn valve(&self, row: usize) -> &str {
        self.valve.at(row).unwrap_or_default()
    }

    /// When a row was.
    pub fn time(&self, row: usize) -> Option<&str> {
        self.time.as_ref()?.at(row)
    }

    /// What a row tells.
    pub fn reading(&self, row: usize) -> Result<Reading, LogErrorKind> {
        fields::valve(self.valve(row))?;
        let cycle = match &self.cycle {
            Column::Texts(texts) => fields::cycle_of_text(texts.at(row).unwrap_or_default().trim_ascii())?,
            Column::Numbers(at) => fields::cycle_of_number(at(row))?,
            Column::Nothing => fields::cycle_of_number(f64::NAN)?,
        };
        let close = self.close.stroke(row, COLUMNS[2], self.empty_is_stalled)?;
        let open = self.open.stroke(row, COLUMNS[3], self.empty_is_stalled)?;
        let mut reading = Reading {
            cycle,
            close_time_s: close.time_s,
            open_time_s: open.time_s,
            stalled: [close.stalled, open.stalled],
            ..Reading::default()
        };
        for (column, values) in &self.conditions {
            let si = match values {
                Column::Texts(texts) => column.of_text(texts.at(row).unwrap_or_default().trim_ascii())?,
                Column::Numbers(at) => column.of_number(at(row))?,
                Column::Nothing => None,
            };
            *if column.is_pressure() { &mut reading.supply_pressure_pa } else { &mut reading.temperature_k } = si;
        }
        Ok(reading)
    }
}

/// What comes out for a row.
pub enum Told {
    /// The prognosis after it.
    Prognosis(Box<Prognosis>),
    /// It is no row.
    Refused(String),
}

/// Probabilities in the order of the program's CSV: those before the status, then those behind it.
fn probabilities() -> (Vec<FaultCall>, Vec<FaultCall>) {
    let others = FaultCall::catalogue().filter(|fault| fault.fault().is_none());
    (vec![FaultCall::None, Fault::Atmosphere.into(), Fault::Supply.into()], others.collect())
}

/// The columns that come out: those of the program's CSV in their order, then what else its JSON has.
pub fn schema() -> SchemaRef {
    let text = |name: &str| Field::new(name, DataType::Utf8, true);
    let number = |name: &str| Field::new(name, DataType::Float64, true);
    let whole = |name: &str| Field::new(name, DataType::Int64, true);
    let (first, others) = probabilities();
    let share = |fault: &FaultCall| number(&format!("p_{}", fault.name().replace('-', "_")));
    let mut all = vec![text("valve"), whole("cycle"), text("fault")];
    all.extend(first.iter().map(share));
    all.extend(
        ["leak_area_mm2", "leak_rate_mm2_per_cycle", "eol_cycle", "rul_cycles", "rul_p05", "rul_p50", "rul_p95"]
            .map(number),
    );
    all.push(text("status"));
    all.extend(others.iter().map(share));
    all.extend([number("severity"), whole("replace_by_cycle")]);
    all.extend(["eol_time", "replace_by", "fault_group", "caveat"].map(text));
    all.push(number("noise_s"));
    all.extend(["time", "notices", "error"].map(text));
    Arc::new(Schema::new(all))
}

/// Columns of what comes out, filled row by row.
pub struct Output {
    schema: SchemaRef,
    faults: (Vec<FaultCall>, Vec<FaultCall>),
    texts: Vec<StringBuilder>,
    numbers: Vec<Float64Builder>,
    wholes: Vec<Int64Builder>,
}

impl Output {
    /// Nothing yet.
    pub fn new() -> Self {
        let schema = schema();
        let count = |kind: &DataType| schema.fields().iter().filter(|field| field.data_type() == kind).count();
        Self {
            texts: (0..count(&DataType::Utf8)).map(|_| StringBuilder::new()).collect(),
            numbers: (0..count(&DataType::Float64)).map(|_| Float64Builder::new()).collect(),
            wholes: (0..count(&DataType::Int64)).map(|_| Int64Builder::new()).collect(),
            faults: probabilities(),
            schema,
        }
    }

    /// Adds a row, its values in the order of the columns of their kind.
    pub fn push(&mut self, valve: &str, told: &Told) -> PyResult<()> {
        let one = match told {
            Told::Prognosis(one) => one,
            Told::Refused(error) => {
                let last = self.texts.len() - 1;
                for (place, column) in self.texts.iter_mut().enumerate() {
                    match place {
                        0 => column.append_value(valve),
                        place if place == last => column.append_value(error),
                        _ => column.append_null(),
                    }
                }
                self.numbers.iter_mut().for_each(Float64Builder::append_null);
                self.wholes.iter_mut().for_each(Int64Builder::append_null);
                return Ok(());
            }
        };
        let group: Vec<&str> = one.fault_group.iter().map(|fault| fault.name()).collect();
        let group = Some(group.join(" ")).filter(|group| !group.is_empty());
        let notices =
            if one.notices.is_empty() { None } else { Some(serde_json::to_string(&one.notices).map_err(refused)?) };
        let texts = [
            Some(one.valve.as_str()),
            Some(one.fault.name()),
            Some(one.status.name()),
            one.eol_time.as_deref(),
            one.replace_by.as_deref(),
            group.as_deref(),
            one.caveat.as_deref(),
            one.time.as_deref(),
            notices.as_deref(),
            None,
        ];
        for (column, text) in self.texts.iter_mut().zip(texts) {
            column.append_option(text);
        }
        let share = |fault: &FaultCall| one.fault_probability.as_ref().map(|all| all.of(*fault));
        let (first, others) = &self.faults;
        let cycles = [one.eol_cycle, one.rul_cycles, one.rul_p05, one.rul_p50, one.rul_p95];
        let numbers = first.iter().map(share).chain([one.leak_area_mm2, one.leak_rate_mm2_per_cycle]).chain(cycles);
        let numbers = numbers.chain(others.iter().map(share)).chain([one.severity, one.noise_s]);
        for (column, number) in self.numbers.iter_mut().zip(numbers) {
            column.append_option(number);
        }
        for (column, whole) in self.wholes.iter_mut().zip([Some(one.cycle), one.replace_by_cycle]) {
            column.append_option(whole.and_then(|whole| i64::try_from(whole).ok()));
        }
        Ok(())
    }

    /// The rows so far as a batch; goes on with none.
    pub fn batch(&mut self) -> PyResult<RecordBatch> {
        let (mut texts, mut numbers, mut wholes) =
            (self.texts.iter_mut(), self.numbers.iter_mut(), self.wholes.iter_mut());
        let columns = self.schema.fields().iter().map(|field| -> Option<ArrayRef> {
            Some(match field.data_type() {
                DataType::Utf8 => Arc::new(texts.next()?.finish()),
                DataType::Float64 => Arc::new(numbers.next()?.finish()),
                _ => Arc::new(wholes.next()?.finish()),
            })
        });
        RecordBatch::try_new(Arc::clone(&self.schema), columns.flatten().collect()).map_err(refused)
    }
}

/// Prognoses, a row for each row that went in.
///
/// Any library that knows Arrow's C interface takes it without copies: ``pyarrow.table(rows)``,
/// ``polars.DataFrame(rows)``.
#[pyclass(frozen, module = "valve_prognosis")]
pub struct Rows(Vec<RecordBatch>);

impl Rows {
    /// From batches of [`Output`].
    pub fn of(batches: Vec<RecordBatch>) -> Self {
        Self(batches)
    }
}

#[pymethods]
impl Rows {
    #[pyo3(signature = (requested_schema = None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        // A consumer may wish for other types; it has to take these, as the interface allows.
        let _ = requested_schema;
        let batches = RecordBatchIterator::new(self.0.clone().into_iter().map(Ok), schema());
        PyCapsule::new_with_value(py, FFI_ArrowArrayStream::new(Box::new(batches)), STREAM)
    }

    fn __len__(&self) -> usize {
        self.0.iter().map(RecordBatch::num_rows).sum()
    }

    /// As a pyarrow table.
    fn to_pyarrow(slf: Bound<'_, Self>) -> PyResult<Bound<'_, PyAny>> {
        slf.py().import("pyarrow")?.call_method1("table", (slf,))
    }

    /// As a pandas data frame.
    fn to_pandas(slf: Bound<'_, Self>) -> PyResult<Bound<'_, PyAny>> {
        Self::to_pyarrow(slf)?.call_method0("to_pandas")
    }

    /// As a Polars data frame.
    fn to_polars(slf: Bound<'_, Self>) -> PyResult<Bound<'_, PyAny>> {
        slf.py().import("polars")?.call_method1("DataFrame", (slf,))
    }

    /// Name and type ("string", "double" or "long") of each column.
    #[staticmethod]
    fn columns() -> Vec<(String, &'static str)> {
        let kind = |field: &Field| match field.data_type() {
            DataType::Utf8 => "string",
            DataType::Float64 => "double",
            _ => "long",
        };
        schema().fields().iter().map(|field| (field.name().clone(), kind(field))).collect()
    }

    fn __repr__(&self) -> String {
        format!("<{} prognoses>", self.__len__())
    }
}
